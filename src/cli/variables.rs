//! Variables of the environment that are named like settings and are none.

use clap::{Arg, Command};

/// What the settings' names begin with.
const PREFIX: &str = "BAGTRACK_";
/// Parts of the names that Kubernetes gives the pods beside a service called `bagtrack`.
const OF_KUBERNETES: [&str; 2] = ["_SERVICE_", "_PORT"];

/// Warns of variables that no flag of this command reads: a setting whose name is misspelt does nothing.
pub fn check(command: &Command) {
    let commands = || std::iter::once(command).chain(command.get_subcommands());
    let is_known = |name: &str| {
        let mut known = commands()
            .flat_map(Command::get_arguments)
            .filter_map(Arg::get_env);
        known.any(|known| known == name)
    };
    let names = std::env::vars_os().filter_map(|(name, _)| name.into_string().ok());
    for name in names.filter(|name| name.starts_with(PREFIX)) {
        if !is_known(&name) && !OF_KUBERNETES.iter().any(|part| name.contains(part)) {
            tracing::warn!(
                "{name} is no setting, and changes nothing: `bagtrack serve --help` has all"
            );
        }
    }
}
