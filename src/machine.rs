//! What the machine has: memory.

use std::fs::read_to_string;
use std::path::{Path, PathBuf};

/// Memory that a render may take.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MemoryLimit {
    /// Bytes.
    pub bytes: u64,
    /// Who sets it, as in "this machine has".
    pub of: &'static str,
}

/// The memory that is left to this program. None where the system does not tell.
pub fn memory() -> Option<MemoryLimit> {
    let read = |path: &str| read_to_string(path).unwrap_or_default();
    let (limits, status) = (read("/proc/self/limits"), read("/proc/self/status"));
    let found = [
        (available(&read("/proc/meminfo")), "this machine has"),
        (left(&limits, "Max address space", &status, "VmSize:"), "ulimit -v leaves"),
        (left(&limits, "Max data size", &status, "VmData:"), "ulimit -d leaves"),
        (of_control_groups(&read("/proc/self/cgroup")), "its control group leaves"),
    ];
    let known = found.into_iter().filter_map(|(bytes, of)| Some(MemoryLimit { bytes: bytes?, of }));
    known.min_by_key(|limit| limit.bytes)
}

/// The same, but no more than `most` bytes, where those are given.
#[cfg(feature = "cli")]
pub fn memory_below(most: Option<u64>) -> Option<MemoryLimit> {
    let asked = most.map(|bytes| MemoryLimit { bytes, of: "--memory allows" });
    memory().into_iter().chain(asked).min_by_key(|limit| limit.bytes)
}

/// A line of /proc/meminfo or /proc/self/status in bytes.
fn kilobytes(text: &str, name: &str) -> Option<u64> {
    let rest = text.lines().find_map(|line| line.strip_prefix(name))?;
    Some(1024 * rest.split_whitespace().next()?.parse::<u64>().ok()?)
}

fn available(meminfo: &str) -> Option<u64> {
    Some(kilobytes(meminfo, "MemAvailable:")? + kilobytes(meminfo, "SwapFree:").unwrap_or(0))
}

/// What a limit of the shell leaves beyond what is used. None where it is unlimited.
fn left(limits: &str, limit: &str, status: &str, used: &str) -> Option<u64> {
    let rest = limits.lines().find_map(|line| line.strip_prefix(limit))?;
    let most: u64 = rest.split_whitespace().next()?.parse().ok()?;
    Some(most.saturating_sub(kilobytes(status, used)?))
}

/// The least that this process's control groups leave, of either version, those above them included.
fn of_control_groups(groups: &str) -> Option<u64> {
    let of_group = |line: &str| {
        let mut parts = line.splitn(3, ':').skip(1);
        let (controllers, path) = (parts.next()?, parts.next()?);
        let (root, files) = match controllers {
            "" => ("/sys/fs/cgroup", ["memory.max", "memory.current", "inactive_file"]),
            _ if controllers.split(',').any(|name| name == "memory") => (
                "/sys/fs/cgroup/memory",
                ["memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file"],
            ),
            _ => return None,
        };
        let group = PathBuf::from(root).join(path.trim_start_matches('/'));
        let above = group.ancestors().take_while(|folder| folder.starts_with(root));
        above.filter_map(|folder| left_in(folder, files)).min()
    };
    groups.lines().filter_map(of_group).min()
}

/// What one control group leaves. Files that are only remembered, not in use, make way.
fn left_in(folder: &Path, [most, used, idle]: [&str; 3]) -> Option<u64> {
    let number = |name: &str| read_to_string(folder.join(name)).ok()?.trim().parse::<u64>().ok();
    let stat = read_to_string(folder.join("memory.stat")).unwrap_or_default();
    let idle = stat.lines().find_map(|line| line.strip_prefix(idle)?.trim().parse::<u64>().ok());
    Some(number(most)?.saturating_sub(number(used)?.saturating_sub(idle.unwrap_or(0))))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_that_is_left_is_read_from_what_the_system_tells() {
        let meminfo = "MemTotal: 1000 kB\nMemAvailable:   600 kB\nSwapFree: 24 kB\n";
        assert_eq!(available(meminfo), Some(624 * 1024));
        assert_eq!(available("MemTotal: 1000 kB\n"), None);
        let limits = "Max data size             unlimited            unlimited            bytes\n\
                      Max address space         6144000              unlimited            bytes\n";
        let status = "VmSize:\t    1000 kB\nVmData:\t 10 kB\n";
        assert_eq!(left(limits, "Max address space", status, "VmSize:"), Some(6_144_000 - 1_024_000));
        assert_eq!(left(limits, "Max data size", status, "VmData:"), None);
    }

    #[test]
    fn a_control_group_leaves_its_limit_less_what_is_in_use() {
        let folder = tempfile::tempdir().expect("a folder");
        let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).expect("written");
        let files = ["memory.max", "memory.current", "inactive_file"];
        assert_eq!(left_in(folder.path(), files), None);
        write("memory.current", "700\n");
        write("memory.max", "max\n");
        assert_eq!(left_in(folder.path(), files), None);
        write("memory.max", "1000\n");
        assert_eq!(left_in(folder.path(), files), Some(300));
        write("memory.stat", "anon 1\ninactive_file 150\n");
        assert_eq!(left_in(folder.path(), files), Some(450));
    }
}
