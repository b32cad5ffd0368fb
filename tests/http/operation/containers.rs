//! The memory limits of the containers in `docker/`, against the memory that the program announces for their settings.
#![cfg(unix)]

use crate::program::Program;
use std::path::Path;
use std::process::Command;

/// The text between `before` and the next `after`, in the line that has `before`.
fn between<'a>(text: &'a str, before: &str, after: &str) -> &'a str {
    let rest = text
        .split_once(before)
        .unwrap_or_else(|| panic!("{before} is missing"));
    rest.1.split(after).next().unwrap().trim().trim_matches('"')
}

/// The settings of the program in a file of compose or of the Helm chart, where they are plain values.
fn settings(text: &str) -> Vec<(String, String)> {
    let lines = text
        .lines()
        .map(str::trim)
        .filter(|line| !line.starts_with('#'));
    let pairs = lines.filter_map(|line| {
        let (name, value) = line.split_once(": ")?;
        let is_number = value.trim_matches('"').parse::<u64>().is_ok();
        let is_setting = name.starts_with("BAGTRACK_") && is_number;
        is_setting.then(|| (name.to_owned(), value.trim_matches('"').to_owned()))
    });
    pairs.collect()
}

/// The most resident memory in MiB that the program announces for these settings.
fn promised(settings: &[(String, String)], workers: &str) -> u64 {
    let variables = settings.iter().map(|(name, value)| (&**name, &**value));
    let variables: Vec<_> = variables.chain([("BAGTRACK_WORKERS", workers)]).collect();
    let mut program = Program::start(&[], &variables);
    let line = program.logs("resident memory stays below ");
    between(&line, "resident memory stays below ", " MiB")
        .parse()
        .unwrap()
}

/// The threshold of the memory alert, in bytes.
fn alerted(docker: &Path) -> f64 {
    let alerts = std::fs::read_to_string(docker.join("prometheus/alerts.yaml")).unwrap();
    let expression = "process_resident_memory_bytes{job=\"bagtrack\"} > ";
    between(&alerts, expression, "\n").parse().unwrap()
}

#[test]
fn what_the_program_promises_fits_into_its_container_and_an_alert_comes_before_the_limit() {
    let docker = Path::new(env!("CARGO_MANIFEST_DIR")).join("docker");
    let alerted = alerted(&docker);
    for (file, cpus, memory, unit) in [
        ("compose.yaml", "\n    cpus: ", "\n    mem_limit: ", "g"),
        (
            "compose.replicas.yaml",
            "\n  cpus: ",
            "\n  mem_limit: ",
            "g",
        ),
        (
            "../deploy/helm/values.yaml",
            "requests: {cpu: ",
            "limits: {memory: ",
            "Gi",
        ),
    ] {
        let text = std::fs::read_to_string(docker.join(file)).unwrap();
        let settings = settings(&text);
        assert!(settings.len() >= 4, "{file}: {settings:?}");
        // The program starts a worker for each processor of the container.
        let workers = between(&text, cpus, if unit == "g" { "\n" } else { "," });
        let limit = between(&text, memory, unit);
        let limit = limit.parse::<u64>().unwrap() << 10;
        let promised = promised(&settings, workers);
        assert!(promised < limit, "{file}: {promised} MiB of {limit}");
        // The alert must be above the announced memory, and below the limit at which the container is killed.
        let mib = alerted / f64::from(1 << 20);
        let range = promised as f64..limit as f64;
        assert!(range.contains(&mib), "{file}: {mib} MiB of {range:?}");
    }
}

#[test]
fn the_container_of_https_has_the_limits_of_the_one_without() {
    let docker = Path::new(env!("CARGO_MANIFEST_DIR")).join("docker");
    let text = std::fs::read_to_string(docker.join("compose.tls.yaml")).unwrap();
    assert!(text.contains("file: compose.yaml\n      service: bagtrack\n"));
    for bound in ["BAGTRACK_MAX_", "mem_limit", "cpus"] {
        assert!(!text.contains(bound), "{bound} is set again");
    }
}

/// ffmpeg writes what it reads of an MP4 or WebM to `/tmp`, where nothing can be written in a container whose files
/// cannot.
#[test]
fn a_read_only_container_has_room_for_videos() {
    let docker = Path::new(env!("CARGO_MANIFEST_DIR")).join("docker");
    for file in ["compose.yaml", "compose.replicas.yaml"] {
        let text = std::fs::read_to_string(docker.join(file)).unwrap();
        assert!(text.contains("read_only: true"), "{file}");
        let room = between(&text, "tmpfs: [\"/tmp:size=", "\"]");
        let bodies = settings(&text)
            .into_iter()
            .find(|(name, _)| name == "BAGTRACK_MAX_UPLOAD_BYTES");
        assert_eq!(bodies.expect("a bound of bodies").1, room, "{file}");
    }
}

/// cargo refuses a workspace whose members are not all there, whether they are built or not.
#[test]
fn an_image_is_built_of_a_whole_workspace() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    for (file, ignored) in [
        ("docker/Dockerfile", ".dockerignore"),
        (
            "docker/label-studio/Dockerfile",
            "docker/label-studio/Dockerfile.dockerignore",
        ),
    ] {
        let kept = std::fs::read_to_string(root.join(ignored)).unwrap();
        let kept: Vec<&str> = kept.lines().filter_map(|it| it.strip_prefix('!')).collect();
        let context = tempfile::tempdir().unwrap();
        let dockerfile = std::fs::read_to_string(root.join(file)).unwrap();
        let (build, _) = dockerfile
            .split_once("\nFROM ${RUST_IMAGE} AS build\n")
            .and_then(|(_, rest)| rest.split_once("\nFROM "))
            .expect("there is a stage that builds");
        for line in build.lines().filter_map(|line| line.strip_prefix("COPY ")) {
            let (sources, into) = line.rsplit_once(' ').expect("a source and a place");
            for source in sources.split(' ') {
                let is_kept = kept.iter().any(|it| Path::new(source).starts_with(it));
                assert!(is_kept, "{ignored} leaves out {source}");
                let place = match into.ends_with('/') {
                    true => context.path().join(source),
                    false => context.path().join(into),
                };
                std::fs::create_dir_all(place.parent().unwrap()).unwrap();
                std::os::unix::fs::symlink(root.join(source), place).unwrap();
            }
        }
        for member in ["python", "sim"].map(|name| context.path().join(name)) {
            if !member.is_symlink() {
                // The Dockerfile makes an empty crate of this member.
                std::fs::create_dir_all(member.join("src")).unwrap();
                std::fs::write(member.join("src/lib.rs"), "").unwrap();
            }
        }
        let told = Command::new(env!("CARGO"))
            .args(["metadata", "--no-deps", "--offline", "--locked"])
            .args(["--format-version", "1", "--manifest-path"])
            .arg(context.path().join("Cargo.toml"))
            .output()
            .unwrap();
        let error = String::from_utf8_lossy(&told.stderr);
        assert!(told.status.success(), "{file}: {error}");
    }
}
