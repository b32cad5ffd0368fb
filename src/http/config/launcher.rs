//! What starts the program that decodes videos.

use super::settings::ConfigError;
use clap::{ArgMatches, Args, Command, Error, FromArgMatches};
use std::ffi::OsString;

/// A program that gives up rights and becomes the one that decodes videos, with its own arguments before that one's name;
/// no words where that is started by itself. It has no flag: the program `bagtrack` starts itself so.
#[derive(Debug, Clone, Default)]
pub struct Launcher(pub Vec<OsString>);

impl Launcher {
    pub(super) fn check_ranges(&self) -> Result<(), ConfigError> {
        Ok(())
    }
}

impl Args for Launcher {
    fn augment_args(command: Command) -> Command {
        command
    }

    fn augment_args_for_update(command: Command) -> Command {
        command
    }
}

impl FromArgMatches for Launcher {
    fn from_arg_matches(_: &ArgMatches) -> Result<Self, Error> {
        Ok(Self::default())
    }

    fn update_from_arg_matches(&mut self, _: &ArgMatches) -> Result<(), Error> {
        Ok(())
    }
}
