//! Every message of a bag, as one line a topic: for comparing with other readers, and for the speed of one pass.

use std::time::Instant;

use portolan_ros::container::{Bag, BagOptions};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments: Vec<String> = std::env::args().skip(1).collect();
    let allow_truncated =
        arguments.iter().position(|a| a == "--allow-truncated").map(|i| arguments.remove(i)).is_some();
    let mut out = String::new();
    for path in arguments {
        let start = Instant::now();
        let bag = Bag::open(&path, &BagOptions { allow_truncated })?;
        let opened = start.elapsed().as_secs_f64();
        let topics: Vec<u32> = (0..bag.topics().len() as u32).collect();
        // CRC-32 over times, lengths and bytes, in the order of times.
        let mut hashes = vec![crc32fast::Hasher::new(); topics.len()];
        let mut data = Vec::new();
        for message in bag.messages(&topics) {
            bag.read(&message, &mut data)?;
            let hash = &mut hashes[message.topic as usize];
            hash.update(&message.log_time.to_le_bytes());
            hash.update(&(data.len() as u64).to_le_bytes());
            hash.update(&data);
        }
        let start = Instant::now();
        let mut bytes = 0;
        bag.for_each(&topics, |_, data| -> Result<(), portolan_ros::BagError> {
            bytes += data.len();
            Ok(())
        })?;
        let pass = start.elapsed().as_secs_f64();
        let mut lines: Vec<String> = Vec::new();
        for ((topic, count), hash) in bag.topics().iter().zip(bag.counts()).zip(hashes) {
            let (first, last) = count.log_times.unwrap_or_default();
            let publisher = topic.publisher.as_deref().unwrap_or("-");
            let (hash, latched) = (hash.finalize(), u8::from(topic.latched));
            lines.push(format!(
                "{} {} {publisher} {latched} {} {first} {last} {hash:08x}",
                topic.name, topic.type_name, count.messages
            ));
        }
        lines.sort();
        out += &format!(
            "{path}: {:?}, index {opened:.3} s, {bytes} bytes in {pass:.3} s\n{}\n",
            bag.kind(),
            lines.join("\n")
        );
        bag.notes().iter().for_each(|note| out += &format!("note: {note}\n"));
    }
    std::io::Write::write_all(&mut std::io::stdout(), out.as_bytes())?;
    Ok(())
}
