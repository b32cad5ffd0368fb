//! Variables of the environment that set nothing: empty ones, and those whose names look like settings but are none.

use clap::{Arg, Command};

/// What the settings' names begin with.
const PREFIX: &str = "BAGTRACK_";
/// Parts of the names that Kubernetes gives the pods beside a service called `bagtrack`.
const OF_KUBERNETES: [&str; 2] = ["_SERVICE_", "_PORT"];

/// The heading of the settings that say who may use the service.
const ACCESS: &str = "Access and keys";

/// The command, which takes empty variables as not set, since charts and compose files pass settings that nobody gave
/// as empty. Empty variables of access are refused instead: a key that was lost on its way must not open the service.
pub fn without_empty(command: Command) -> Command {
    let without = |arg: Arg| match is_left_out(&arg) {
        true => arg.env(None::<&str>),
        false => arg,
    };
    let command = command.mut_args(without);
    command.mut_subcommands(|command| command.mut_args(without))
}

fn is_left_out(arg: &Arg) -> bool {
    let value = arg.get_env().and_then(std::env::var_os);
    value.is_some_and(|value| value.is_empty()) && arg.get_help_heading() != Some(ACCESS)
}

/// Warns of variables that no flag of this command reads: a setting whose name is misspelt does nothing.
pub fn check(command: &Command) {
    let commands = || std::iter::once(command).chain(command.get_subcommands());
    let is_known = |name: &str| {
        let mut known = commands()
            .flat_map(Command::get_arguments)
            .filter_map(Arg::get_env);
        known.any(|known| known == name)
    };
    let variables = std::env::vars_os().filter(|(_, value)| !value.is_empty());
    let names = variables.filter_map(|(name, _)| name.into_string().ok());
    for name in names.filter(|name| name.starts_with(PREFIX)) {
        if !is_known(&name) && !OF_KUBERNETES.iter().any(|part| name.contains(part)) {
            tracing::warn!(
                "{name} is no setting, and changes nothing: `bagtrack serve --help` has all"
            );
        }
    }
}
