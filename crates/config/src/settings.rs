//! Settings as rows of a table: the help text, the name, the type, the default and the range of each setting stand in
//! one place, below its heading in the help.
//!
//! From such a table the macro [`settings`] makes the struct, its defaults, its flags with their environment variables,
//! and the check of its ranges.

use super::base_path::BasePath;
use super::flag_values::{parse_duration, parse_listen, parse_network, parse_whole};
use bagtrack_cli::ModelFiles;
use bagtrack_sessions::Durability;
use clap::builder::{BoolishValueParser, ValueParser};
use clap::{Arg, ArgAction, ArgMatches, value_parser};
use ipnet::IpNet;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::Duration;

/// A text that debug output does not show.
#[derive(Clone, PartialEq, Eq)]
pub struct Secret(String);

impl Secret {
    /// The text.
    pub fn text(&self) -> &str {
        &self.0
    }
}

impl From<&str> for Secret {
    fn from(text: &str) -> Self {
        Self(text.trim().to_owned())
    }
}

impl From<String> for Secret {
    fn from(text: String) -> Self {
        Self::from(text.as_str())
    }
}

impl AsRef<[u8]> for Secret {
    fn as_ref(&self) -> &[u8] {
        self.0.as_bytes()
    }
}

impl std::fmt::Debug for Secret {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str("Secret")
    }
}

/// A type of values on the command line.
pub(super) trait Value: Clone + Send + Sync + 'static {
    /// The name of the value in the help, where that is not the setting's name.
    const NAME: Option<&'static str> = None;
    /// Whether the help hides the value that the environment gives.
    const IS_SECRET: bool = false;
    /// The parser of the value's text.
    fn parser() -> ValueParser;
    /// The text of the value, as it is written on the command line.
    fn written(&self) -> String {
        String::new()
    }
}

/// Implements [`Value`] for types that are written as they are displayed.
macro_rules! values {
    ($($type:ty: $parser:expr $(, $name:literal)?;)*) => {
        $(impl Value for $type {
            $(const NAME: Option<&'static str> = Some($name);)?
            fn parser() -> ValueParser {
                ValueParser::from($parser)
            }
            fn written(&self) -> String {
                self.to_string()
            }
        })*
    };
}

values! {
    u32: parse_whole::<u32>;
    u64: parse_whole::<u64>;
    usize: parse_whole::<usize>;
    String: value_parser!(String);
    SocketAddr: parse_listen;
    IpNet: parse_network;
    BasePath: value_parser!(BasePath), "PATH";
    Durability: value_parser!(Durability), "TIME|each";
}

impl Value for Duration {
    fn parser() -> ValueParser {
        ValueParser::from(parse_duration)
    }
    fn written(&self) -> String {
        humantime::format_duration(*self).to_string()
    }
}

impl Value for PathBuf {
    const NAME: Option<&'static str> = Some("FILE");
    fn parser() -> ValueParser {
        value_parser!(PathBuf)
    }
}

impl Value for ModelFiles {
    fn parser() -> ValueParser {
        value_parser!(ModelFiles).into()
    }
}

impl Value for Secret {
    const IS_SECRET: bool = true;
    fn parser() -> ValueParser {
        value_parser!(Secret).into()
    }
}

/// The type of a setting: a value with a default, one that may be left out, a list, or a switch.
pub(super) trait Setting: Sized {
    /// Completes the flag of a setting with this default.
    fn flag(arg: Arg, default: &Self) -> Arg;
    /// Takes the setting of this name from the given flags and variables.
    fn take(matches: &mut ArgMatches, name: &str) -> Self;
}

fn of_value<V: Value>(arg: Arg) -> Arg {
    let arg = arg.value_parser(V::parser()).hide_env_values(V::IS_SECRET);
    match V::NAME {
        Some(name) => arg.value_name(name),
        None => arg,
    }
}

impl<V: Value> Setting for V {
    fn flag(arg: Arg, default: &Self) -> Arg {
        of_value::<V>(arg).default_value(default.written())
    }
    fn take(matches: &mut ArgMatches, name: &str) -> Self {
        let value = matches.remove_one(name);
        value.expect("the flag has a default")
    }
}

impl<V: Value> Setting for Option<V> {
    fn flag(arg: Arg, _: &Self) -> Arg {
        of_value::<V>(arg)
    }
    fn take(matches: &mut ArgMatches, name: &str) -> Self {
        matches.remove_one(name)
    }
}

impl<V: Value> Setting for Vec<V> {
    fn flag(arg: Arg, _: &Self) -> Arg {
        of_value::<V>(arg)
            .action(ArgAction::Append)
            .value_delimiter(',')
    }
    fn take(matches: &mut ArgMatches, name: &str) -> Self {
        matches.remove_many(name).into_iter().flatten().collect()
    }
}

impl Setting for bool {
    fn flag(arg: Arg, _: &Self) -> Arg {
        arg.action(ArgAction::SetTrue)
            .value_parser(BoolishValueParser::new())
    }
    fn take(matches: &mut ArgMatches, name: &str) -> Self {
        matches.remove_one(name).unwrap_or_default()
    }
}

/// The flag of a setting, and its variable: `max_frames` is `--max-frames` and `BAGTRACK_MAX_FRAMES`.
pub(super) fn flag<S: Setting>(
    name: &'static str,
    heading: &'static str,
    doc: &[&str],
    default: &S,
) -> Arg {
    let lines: Vec<&str> = doc.iter().map(|line| line.trim()).collect();
    let help = lines.join(" ");
    let arg = Arg::new(name)
        .long(name.replace('_', "-"))
        .env(format!("BAGTRACK_{}", name.to_uppercase()))
        .value_name(name.to_uppercase())
        .help_heading(heading)
        .help(help.strip_suffix('.').unwrap_or(&help).to_owned());
    S::flag(arg, default)
}

/// Checks a setting's value. The error says what the value must be.
pub(super) type Range<T> = fn(&T) -> Result<(), &'static str>;

/// At least 1.
pub(super) fn positive<T: From<u8> + PartialOrd>(value: &T) -> Result<(), &'static str> {
    in_range(*value >= T::from(1), "at least 1")
}

/// At least 1, or not given.
pub(super) fn positive_share(value: &Option<usize>) -> Result<(), &'static str> {
    value.as_ref().map_or(Ok(()), positive)
}

/// As many threads as one process can be expected to start, where their number is given.
pub(super) fn threads(value: &Option<usize>) -> Result<(), &'static str> {
    let hold = value.is_none_or(|threads| (1..=1024).contains(&threads));
    in_range(hold, "from 1 to 1024")
}

/// A number of permits that a semaphore can have.
pub(super) fn permits(value: &usize) -> Result<(), &'static str> {
    let most = tokio::sync::Semaphore::MAX_PERMITS;
    in_range((1..=most).contains(value), "from 1 to 2^61 - 1")
}

const YEAR: Duration = Duration::from_secs(365 * 24 * 3600);

/// A time that must not be zero: from 1 ms to 1 year.
pub(super) fn moment(value: &Duration) -> Result<(), &'static str> {
    let range = Duration::from_millis(1)..=YEAR;
    in_range(range.contains(value), "between 1ms and 1 year")
}

/// A time to wait, which may be zero: at most 1 year.
pub(super) fn delay(value: &Duration) -> Result<(), &'static str> {
    in_range(*value <= YEAR, "at most 1 year")
}

/// Origins like `https://example.org`, or `*` for all.
pub(super) fn origins(values: &[String]) -> Result<(), &'static str> {
    let plain = |byte: u8| byte.is_ascii_graphic() && byte != b'/';
    let is_origin = |text: &String| {
        let host = text.split_once("://").map_or("", |(_, host)| host);
        text == "*" || (!host.is_empty() && host.bytes().all(plain))
    };
    let hold = values.iter().all(is_origin);
    in_range(hold, "origins like https://example.org, or *")
}

/// Hosts like `example.org` or `example.org:8443`.
pub(super) fn hosts(values: &[String]) -> Result<(), &'static str> {
    let is_part = |byte: u8| byte.is_ascii_graphic() && !b"/*@".contains(&byte);
    let is_host = |text: &String| !text.is_empty() && text.bytes().all(is_part);
    let hold = values.iter().all(is_host);
    in_range(
        hold,
        "hosts like example.org or example.org:8443, with no space around",
    )
}

/// An error with `expected` unless the value is `inside` its range.
pub(super) fn in_range(inside: bool, expected: &'static str) -> Result<(), &'static str> {
    match inside {
        true => Ok(()),
        false => Err(expected),
    }
}

/// A setting out of its range.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("--{} (BAGTRACK_{}) must be {expected}", name.replace('_', "-"), name.to_uppercase())]
pub struct ConfigError {
    name: &'static str,
    expected: &'static str,
}

impl ConfigError {
    /// The error for the setting `name`, where the check of its range has failed.
    pub(super) fn check(name: &'static str, held: Result<(), &'static str>) -> Result<(), Self> {
        held.map_err(|expected| Self { name, expected })
    }
}

/// Makes a struct of settings from a table with a row for each: its text, `name: type = default`, and its range. A line
/// `# "Heading"` gives the heading of the rows below it in the help. Settings under `by_code` have no flags; each one
/// under `flattened` is a table of its own.
macro_rules! settings {
    (
        $(#[$of_struct:meta])*
        pub struct $struct:ident {
            $(# $heading:literal
                $($(#[doc = $doc:literal])* $name:ident: $type:ty = $default:expr $(, $range:expr)? $(, as $shown:literal)?;)+
            )+
        }
        $(by_code {
            $($(#[doc = $code_doc:literal])* $code:ident: $code_type:ty;)*
        })?
        $(flattened {
            $($(#[doc = $part_doc:literal])* $(#[cfg($part_cfg:meta)])? $part:ident: $part_type:ty;)*
        })?
    ) => {
        $(#[$of_struct])*
        #[derive(Debug, Clone)]
        pub struct $struct {
            $($($(#[doc = $doc])* pub $name: $type,)+)+
            $($($(#[doc = $code_doc])* pub $code: $code_type,)*)?
            $($($(#[doc = $part_doc])* $(#[cfg($part_cfg)])? pub $part: $part_type,)*)?
        }

        impl Default for $struct {
            /// The settings that hold where no other is given. Neither flags nor the environment are read.
            fn default() -> Self {
                Self {
                    $($($name: $default,)+)+
                    $($($code: Default::default(),)*)?
                    $($($(#[cfg($part_cfg)])? $part: <$part_type>::default(),)*)?
                }
            }
        }

        impl clap::Args for $struct {
            fn augment_args(command: clap::Command) -> clap::Command {
                let defaults = Self::default();
                let command = command
                    $($(.arg({
                        let arg = $crate::settings::flag(
                            stringify!($name), $heading, &[$($doc),*], &defaults.$name,
                        );
                        $(let arg = arg.value_name($shown);)?
                        arg
                    }))+)+;
                $($($(#[cfg($part_cfg)])? let command = <$part_type as clap::Args>::augment_args(command);)*)?
                command
            }

            fn augment_args_for_update(command: clap::Command) -> clap::Command {
                Self::augment_args(command)
            }
        }

        impl clap::FromArgMatches for $struct {
            fn from_arg_matches(matches: &clap::ArgMatches) -> Result<Self, clap::Error> {
                Self::from_arg_matches_mut(&mut matches.clone())
            }

            fn from_arg_matches_mut(matches: &mut clap::ArgMatches) -> Result<Self, clap::Error> {
                use $crate::settings::Setting;
                Ok(Self {
                    $($($name: Setting::take(matches, stringify!($name)),)+)+
                    $($($code: Default::default(),)*)?
                    $($($(#[cfg($part_cfg)])? $part: <$part_type>::from_arg_matches_mut(matches)?,)*)?
                })
            }

            fn update_from_arg_matches(&mut self, matches: &clap::ArgMatches) -> Result<(), clap::Error> {
                *self = Self::from_arg_matches(matches)?;
                Ok(())
            }
        }

        impl $struct {
            /// Checks the settings that have a range of their own.
            pub(crate) fn check_ranges(
                &self,
            ) -> Result<(), $crate::settings::ConfigError> {
                $($($(
                    let range: $crate::settings::Range<$type> = $range;
                    $crate::settings::ConfigError::check(stringify!($name), range(&self.$name))?;
                )?)+)+
                $($($(#[cfg($part_cfg)])? self.$part.check_ranges()?;)*)?
                Ok(())
            }
        }
    };
}
pub(super) use settings;
