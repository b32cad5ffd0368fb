//! The text of `--help`: the commands on one screen, and the parameters of `--set`.

use crate::command::succeeds;
use bagtrack_tracker::{Params, Preset};

/// The lines of the long help of `track` after the flags, split into words.
fn listed() -> Vec<Vec<String>> {
    let help = succeeds(&["track", "--help"]);
    let (_, list) = help
        .split_once("\nParameters for --set NAME=VALUE")
        .unwrap_or_else(|| panic!("no list of parameters:\n{help}"));
    let words = |line: &str| line.split_whitespace().map(str::to_owned).collect();
    list.trim_end().lines().skip(1).map(words).collect()
}

#[test]
fn the_long_help_has_a_line_for_each_parameter() {
    let robust = serde_json::to_value(Preset::Robust.params()).unwrap();
    let lines = listed();
    assert_eq!(lines.len(), Params::TABLE.len(), "{lines:?}");
    for (line, row) in lines.iter().zip(Params::TABLE) {
        let allowed = match row.range {
            Some((min, max)) => format!("{min} to {max}"),
            None => "whole number".to_owned(),
        };
        let value = robust[row.name].as_f64().unwrap();
        let expected = format!("{} {allowed} {value} {}", row.name, row.description);
        let expected: Vec<&str> = expected.split_whitespace().collect();
        assert_eq!(line, &expected);
    }
}

#[test]
fn the_list_says_what_the_default_preset_has() {
    let line = |name: &str| {
        let lines = listed();
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
    let help = succeeds(&["track", "-h"]);
    assert!(help.contains("`--help` lists the parameters"), "{help}");
    for row in Params::TABLE.iter().filter(|row| row.name.contains('_')) {
        assert!(!help.contains(row.name), "it names {}", row.name);
    }
}

#[test]
fn the_help_of_the_program_fits_a_screen_and_names_the_commands() {
    let help = succeeds(&["--help"]);
    assert!(help.lines().count() <= 24, "{help}");
    for command in ["serve", "track", "eval", "sample", "health", "completions"] {
        let named = help
            .lines()
            .any(|line| line.trim_start().starts_with(command));
        assert!(named, "{command}: {help}");
    }
    assert!(help.contains("bagtrack serve --help"), "{help}");
    // The long help lists the settings, which are also accepted without the command.
    assert!(succeeds(&["serve", "--help"]).contains("--session-idle"));
}

#[test]
fn each_setting_of_the_service_is_below_a_heading() {
    let help = succeeds(&["serve", "-h"]);
    let mut heading = "";
    let mut flags = std::collections::BTreeMap::<&str, Vec<&str>>::new();
    for line in help.lines() {
        let is_heading = !line.starts_with(' ') && line.ends_with(':');
        if is_heading {
            heading = line.trim_end_matches(':');
        } else if let Some(flag) = line.split_whitespace().find(|word| word.starts_with("--")) {
            flags.entry(heading).or_default().push(flag);
        }
    }
    // Each flag has a heading, by the tables of crates/config or by `serve` itself.
    assert_eq!(flags["Options"], ["--help"], "without a heading: {help}");
    assert!(flags["Listening"].contains(&"--listen"), "{help}");
    assert!(flags["Store"].contains(&"--store-prefix"), "{help}");
    assert!(
        flags["Access and keys"].contains(&"--api-keys-file"),
        "{help}"
    );
    assert!(flags["Logging"].contains(&"--log-format"), "{help}");
    let count: usize = flags.values().map(Vec::len).sum();
    assert!(count > 45 && flags.len() >= 10, "{flags:?}");
    let longest = flags.values().map(Vec::len).max();
    assert!(longest <= Some(12), "{flags:?}");
}

#[test]
fn shells_get_scripts_that_complete_commands_and_flags() {
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let script = succeeds(&["completions", shell]);
        for word in ["track", "completions", "draw", "start", "session-idle"] {
            assert!(script.contains(word), "{shell}: no {word}");
        }
    }
    // Runs the completions in a real bash.
    let script = "source <(\"$0\" completions bash); COMP_WORDS=(bagtrack track --dr); COMP_CWORD=2; \
                  _bagtrack bagtrack --dr track; echo \"${COMPREPLY[@]}\"";
    let mut bash = std::process::Command::new("bash");
    bash.args(["-c", script, env!("CARGO_BIN_EXE_bagtrack")]);
    let Ok(output) = bash.output() else {
        eprintln!("left out: there is no bash");
        return;
    };
    assert_eq!(
        String::from_utf8_lossy(&output.stdout).trim(),
        "--draw",
        "{output:?}"
    );
}
