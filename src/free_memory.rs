//! How much memory this process may still take, before a file's own numbers are believed.

/// Bytes that can be had: the least of what the machine has free, what the address space may grow by, and what a control group
/// leaves. None where the system does not say.
pub fn available() -> Option<u64> {
    [machine(), address_space(), control_group()].into_iter().flatten().min()
}

fn read(path: &str) -> Option<String> {
    std::fs::read_to_string(path).ok()
}

/// The number behind a word at the beginning of a line.
fn number_after(text: &str, word: &str) -> Option<u64> {
    text.lines().find_map(|line| line.strip_prefix(word)?.split_whitespace().next()?.parse().ok())
}

fn machine() -> Option<u64> {
    number_after(&read("/proc/meminfo")?, "MemAvailable:").map(|kilobytes| 1024 * kilobytes)
}

/// `ulimit -v` less what is taken.
fn address_space() -> Option<u64> {
    let limit = number_after(&read("/proc/self/limits")?, "Max address space")?;
    let taken = number_after(&read("/proc/self/status")?, "VmSize:")?;
    Some(limit.saturating_sub(1024 * taken))
}

/// Of version 2 of control groups, the process's own group and those around it.
fn control_group() -> Option<u64> {
    let own = read("/proc/self/cgroup")?;
    let own = own.lines().find_map(|line| line.strip_prefix("0::/"))?;
    let number = |folder: &std::path::Path, name: &str| {
        std::fs::read_to_string(folder.join(name)).ok()?.trim().parse::<u64>().ok()
    };
    let root = std::path::Path::new("/sys/fs/cgroup");
    // Cached files give way to whoever wants memory.
    let cached = |folder: &std::path::Path| {
        std::fs::read_to_string(folder.join("memory.stat")).ok().and_then(|stat| number_after(&stat, "file "))
    };
    let left = |folder: &std::path::Path| {
        let taken = number(folder, "memory.current")?.saturating_sub(cached(folder).unwrap_or(0));
        Some(number(folder, "memory.max")?.saturating_sub(taken))
    };
    let folder = root.join(own);
    folder.ancestors().take_while(|folder| folder.starts_with(root)).filter_map(left).min()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_found_by_their_words() {
        let limits = "Limit  Soft  Hard\nMax address space         6144000000  unlimited  bytes\n";
        assert_eq!(number_after(limits, "Max address space"), Some(6_144_000_000));
        assert_eq!(number_after("Max address space  unlimited unlimited bytes", "Max address space"), None);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn there_is_some_memory_and_no_more_than_the_machine_has() {
        let total = number_after(&read("/proc/meminfo").unwrap(), "MemTotal:").unwrap();
        let available = available().unwrap();
        assert!(available > 1 << 20 && available <= 1024 * total, "{available}");
    }
}
