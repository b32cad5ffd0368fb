//! Memory of processes.

/// The value after a word of `/proc/ID/status`, such as `VmRSS:`, in bytes (Linux only).
pub fn of_process(id: u32, word: &str) -> Option<u64> {
    let status = std::fs::read_to_string(format!("/proc/{id}/status")).ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix(word))?;
    let kib = line.split_whitespace().next()?;
    Some(kib.parse::<u64>().ok()? << 10)
}
