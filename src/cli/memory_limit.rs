//! Compares the system's limits of memory with the service's own bound.

use std::fs;
use std::path::Path;

/// Where Linux mounts control groups.
const GROUPS: &str = "/sys/fs/cgroup";

/// Warns where a limit of the system lies below `bound`, in bytes, the most memory that the service takes. The system
/// may then end the service, and all sessions would be lost.
pub fn check(bound: u64) {
    for (name, limit) in [
        (
            "the limit of the address space (ulimit -v)",
            address_space(),
        ),
        ("the limit of the control group", control_group()),
        ("the machine's memory", machine()),
    ] {
        if let Some(limit) = limit.filter(|limit| *limit < bound) {
            tracing::warn!(
                limit = limit >> 20,
                bound = bound >> 20,
                "{name} is below what the service may take, in MiB: it may be ended, with all sessions; \
                 lower --max-upload-bytes, --max-sessions, --max-frame-memory or --workers"
            );
        }
    }
}

#[cfg(unix)]
fn address_space() -> Option<u64> {
    use rustix::process::{Resource, getrlimit};
    getrlimit(Resource::As).current
}

#[cfg(not(unix))]
fn address_space() -> Option<u64> {
    None
}

/// Bytes of memory of the machine.
fn machine() -> Option<u64> {
    let memory = fs::read_to_string("/proc/meminfo").ok()?;
    let line = memory
        .lines()
        .find_map(|line| line.strip_prefix("MemTotal:"));
    let kib = line?.trim().strip_suffix(" kB")?.parse::<u64>().ok()?;
    Some(kib << 10)
}

/// The least limit of the process's control groups and of those above them.
fn control_group() -> Option<u64> {
    let groups = fs::read_to_string("/proc/self/cgroup").ok()?;
    let limits = groups.lines().filter_map(|line| {
        let (_, rest) = line.split_once(':')?;
        let (controllers, path) = rest.split_once(':')?;
        let (root, file) = match controllers {
            "" => (GROUPS.to_owned(), "memory.max"),
            _ if controllers.split(',').any(|name| name == "memory") => {
                (format!("{GROUPS}/memory"), "memory.limit_in_bytes")
            }
            _ => return None,
        };
        let group = Path::new(&root).join(path.trim_start_matches('/'));
        // In a container the path may be the one outside of the container.
        let groups = group
            .ancestors()
            .take_while(|group| group.starts_with(&root));
        let limits = groups.filter_map(|group| {
            let text = fs::read_to_string(group.join(file)).ok()?;
            text.trim().parse::<u64>().ok()
        });
        limits.min()
    });
    limits.min()
}
