//! The chunks that were unpacked last.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};

/// At most so many bytes are kept, and at least the last chunk: a few megabytes a chunk, for as many threads as read.
const LIMIT: usize = 64 << 20;

/// A file and a place in it.
pub(crate) type ChunkKey = (u32, u64);

/// The last used chunks, shared by threads.
#[derive(Default)]
pub(crate) struct ChunkCache {
    /// The last used one at the back.
    chunks: Mutex<VecDeque<(ChunkKey, Arc<Vec<u8>>)>>,
}

impl ChunkCache {
    /// The chunk, loaded where it is not kept. Two threads may load the same one: neither waits for the disk of another.
    pub(crate) fn get<E>(
        &self,
        key: ChunkKey,
        load: impl FnOnce() -> Result<Vec<u8>, E>,
    ) -> Result<Arc<Vec<u8>>, E> {
        {
            let mut chunks = self.chunks.lock().unwrap_or_else(PoisonError::into_inner);
            if let Some(i) = chunks.iter().rposition(|(k, _)| *k == key)
                && let Some(found) = chunks.remove(i)
            {
                chunks.push_back(found.clone());
                return Ok(found.1);
            }
        }
        let chunk = Arc::new(load()?);
        let mut chunks = self.chunks.lock().unwrap_or_else(PoisonError::into_inner);
        chunks.retain(|(k, _)| *k != key);
        chunks.push_back((key, Arc::clone(&chunk)));
        let mut kept: usize = chunks.iter().map(|(_, c)| c.capacity()).sum();
        while kept > LIMIT && chunks.len() > 1 {
            kept -= chunks.pop_front().map_or(0, |(_, c)| c.capacity());
        }
        Ok(chunk)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chunks_are_loaded_once_and_the_oldest_go() {
        let cache = ChunkCache::default();
        let mut loads = 0;
        let mut get = |key, size| {
            let got: Result<_, ()> = cache.get((0, key), || {
                loads += 1;
                Ok(vec![key as u8; size])
            });
            assert_eq!(got.unwrap()[0], key as u8);
            loads
        };
        assert_eq!((get(1, LIMIT / 2), get(2, LIMIT / 2), get(1, 1)), (1, 2, 2));
        // The third is one too many: the second, used longest ago, goes.
        assert_eq!((get(3, LIMIT / 2), get(1, 1), get(2, 9)), (3, 3, 4));
        assert_eq!((get(4, 2 * LIMIT), get(4, 1)), (5, 5));
    }
}
