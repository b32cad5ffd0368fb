//! Fits the number of connections to the system's limit of open files.

use bagtrack::http::Config;
use bagtrack_config::PROBE_CONNECTIONS;

/// Files that are open besides connections: the log, the listener, the runtime's own.
const OTHERS: usize = 64 + PROBE_CONNECTIONS;

/// Raises the soft limit of open files as far as `config` needs and the hard limit allows. Where that is not enough,
/// lowers the number of connections, and logs a warning: otherwise new connections would wait unanswered.
pub fn fit(config: &mut Config) {
    let needed = config.max_connections.saturating_add(OTHERS);
    let have = raise(needed);
    if have < needed {
        let connections = have.saturating_sub(OTHERS).max(1);
        tracing::warn!(
            limit = have,
            needed,
            connections,
            "the limit of open files (nofile, ulimit -n) is too low for --max-connections: fewer are taken"
        );
        config.max_connections = connections;
    }
}

/// The limit of open files, raised to `needed` where it may be.
#[cfg(unix)]
fn raise(needed: usize) -> usize {
    use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
    let Rlimit { current, maximum } = getrlimit(Resource::Nofile);
    let wanted = (needed as u64).min(maximum.unwrap_or(u64::MAX));
    let raised = Rlimit {
        current: Some(wanted),
        maximum,
    };
    let has_enough = current.is_none_or(|current| current >= needed as u64);
    if !has_enough && let Err(error) = setrlimit(Resource::Nofile, raised) {
        tracing::debug!(%error, "cannot raise the limit of open files");
    }
    let now = getrlimit(Resource::Nofile).current;
    now.map_or(usize::MAX, |now| usize::try_from(now).unwrap_or(usize::MAX))
}

#[cfg(not(unix))]
fn raise(needed: usize) -> usize {
    needed
}
