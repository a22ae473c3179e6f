//! Values as CDR *(OMG DDSI-RTPS, XCDR version 1)*: little endian, each aligned to its own size.

/// A message that is being written.
pub(super) struct Cdr(Vec<u8>);

impl Cdr {
    /// Bytes before the message, which say in which order bytes are; they do not count in what is aligned.
    const HEAD: [u8; 4] = [0, 1, 0, 0];

    /// An empty message with room for `bytes`.
    pub(super) fn with_room(bytes: usize) -> Self {
        let mut all = Vec::with_capacity(bytes + Self::HEAD.len());
        all.extend(Self::HEAD);
        Self(all)
    }

    /// The whole message.
    pub(super) fn into_bytes(self) -> Vec<u8> {
        self.0
    }

    fn put<const N: usize>(&mut self, value: [u8; N]) {
        let used = self.0.len() - Self::HEAD.len();
        self.0.resize(self.0.len() + used.next_multiple_of(N) - used, 0);
        self.0.extend(value);
    }

    pub(super) fn u8(&mut self, value: u8) {
        self.put([value]);
    }

    pub(super) fn bool(&mut self, value: bool) {
        self.put([u8::from(value)]);
    }

    pub(super) fn u32(&mut self, value: u32) {
        self.put(value.to_le_bytes());
    }

    pub(super) fn i32(&mut self, value: i32) {
        self.put(value.to_le_bytes());
    }

    pub(super) fn f32(&mut self, value: f32) {
        self.put(value.to_le_bytes());
    }

    pub(super) fn f64(&mut self, value: f64) {
        self.put(value.to_le_bytes());
    }

    /// Its length with the zero byte that ends it, its bytes, the zero byte.
    pub(super) fn string(&mut self, text: &str) {
        self.u32(text.len() as u32 + 1);
        self.0.extend(text.as_bytes());
        self.0.push(0);
    }

    /// A sequence of bytes.
    pub(super) fn bytes(&mut self, count: u32, bytes: impl Iterator<Item = u8>) {
        self.u32(count);
        self.0.extend(bytes);
    }
}
