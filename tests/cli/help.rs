//! What `--help` says: commands on one screen, and the parameters that `--set` takes.

use crate::command::succeeds;
use bagtrack_tracker::{Params, Preset};

/// The lines of the long help after the flags, in words.
fn listed(command: &str) -> Vec<Vec<String>> {
    let help = succeeds(&[command, "--help"]);
    let (_, list) = help
        .split_once("\nParameters for --set NAME=VALUE")
        .unwrap_or_else(|| panic!("no list of parameters:\n{help}"));
    let words = |line: &str| line.split_whitespace().map(str::to_owned).collect();
    list.trim_end().lines().skip(1).map(words).collect()
}

#[test]
fn the_long_help_has_a_line_for_each_parameter() {
    let robust = serde_json::to_value(Preset::Robust.params()).unwrap();
    for command in ["track", "eval"] {
        let lines = listed(command);
        assert_eq!(lines.len(), Params::TABLE.len(), "{command}: {lines:?}");
        for (line, row) in lines.iter().zip(Params::TABLE) {
            let allowed = match row.range {
                Some((min, max)) => format!("{min} to {max}"),
                None => "whole number".to_owned(),
            };
            let value = robust[row.name].as_f64().unwrap();
            let expected = format!("{} {allowed} {value} {}", row.name, row.description);
            let expected: Vec<&str> = expected.split_whitespace().collect();
            assert_eq!(line, &expected, "{command}");
        }
    }
}

#[test]
fn the_list_says_what_the_default_preset_has() {
    let line = |name: &str| {
        let lines = listed("track");
        let line = lines.iter().find(|line| line[0] == name);
        line.unwrap_or_else(|| panic!("{name} is missing"))
            .join(" ")
    };
    assert!(line("particles").starts_with("particles 1 to 1000 200 N, the number of particles"));
    assert!(line("sigma").starts_with("sigma 0.0001 to 100 0.01 σ, the distance"));
    assert!(line("seed").starts_with("seed whole number 0 Seed of all random draws"));
}

#[test]
fn the_short_help_stays_short_and_points_to_the_long_one() {
    for command in ["track", "eval"] {
        let help = succeeds(&[command, "-h"]);
        assert!(help.contains("`--help` lists the parameters"), "{help}");
        for row in Params::TABLE.iter().filter(|row| row.name.contains('_')) {
            assert!(!help.contains(row.name), "{command} -h names {}", row.name);
        }
    }
}

#[test]
fn the_help_of_the_program_fits_a_screen_and_names_the_commands() {
    let help = succeeds(&["--help"]);
    assert!(help.lines().count() <= 24, "{help}");
    for command in ["serve", "track", "eval", "sample", "health"] {
        let named = help
            .lines()
            .any(|line| line.trim_start().starts_with(command));
        assert!(named, "{command}: {help}");
    }
    assert!(help.contains("bagtrack serve --help"), "{help}");
    // The settings are where it says, and hold without the command, too.
    assert!(succeeds(&["serve", "--help"]).contains("--session-idle"));
}
