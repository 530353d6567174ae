//! How much memory this process has used at most, and how much it could have.

use std::fs::read_to_string;

/// Largest resident size of this process so far, in bytes; `None` where the system does not tell (it does on Linux).
pub fn peak_bytes() -> Option<u64> {
    kibibytes(&read_to_string("/proc/self/status").ok()?, "VmHWM:")
}

/// Bytes that can be had without pushing others out: what the system calls available, and what the control group of this
/// process leaves where it has a limit; `None` where the system does not tell (it does on Linux).
pub fn available_bytes() -> Option<u64> {
    let system = kibibytes(&read_to_string("/proc/meminfo").ok()?, "MemAvailable:")?;
    Some(system.min(group_bytes().unwrap_or(u64::MAX)))
}

fn kibibytes(text: &str, key: &str) -> Option<u64> {
    let line = text.lines().find(|line| line.starts_with(key))?;
    line.split_whitespace().nth(1)?.parse::<u64>().ok()?.checked_mul(1024)
}

/// What the control group leaves; `None` without a limit.
fn group_bytes() -> Option<u64> {
    let number = |file: &str| read_to_string(file).ok()?.trim().parse::<u64>().ok();
    let of = |limit: &str, used: &str| Some(number(limit)?.saturating_sub(number(used)?));
    let second = || of("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory.current");
    let first = || of("/sys/fs/cgroup/memory/memory.limit_in_bytes", "/sys/fs/cgroup/memory/memory.usage_in_bytes");
    second().or_else(first)
}
