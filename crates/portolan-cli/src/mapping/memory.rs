//! Memory of the process and of the machine.

/// The most memory that this process has held at once (bytes), where the system reports it.
pub(crate) fn peak_memory() -> Option<u64> {
    field("/proc/self/status", "VmHWM:")
}

/// Memory that can be had without pushing anything out (bytes), where the system reports it.
pub(crate) fn available_memory() -> Option<u64> {
    field("/proc/meminfo", "MemAvailable:")
}

fn field(file: &str, name: &str) -> Option<u64> {
    let text = std::fs::read_to_string(file).ok()?;
    let line = text.lines().find_map(|l| l.strip_prefix(name))?;
    Some(line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()? * 1024)
}

/// What is said where a map of sums is larger than --memory.
pub(crate) const TOO_LARGE: &str = "the map takes more memory than --memory allows: it was written alone, without surface, distances \
     and pictures; give more, or map a part with --bounds";

/// Whether reading failed because there was not enough memory.
pub(crate) fn is_about_memory(error: &anyhow::Error) -> bool {
    error.chain().any(|cause| {
        matches!(
            cause.downcast_ref::<portolan_io::IoError>(),
            Some(portolan_io::IoError::Binary { field, .. }) if field == "a length of map data"
        )
    })
}
