//! The program with a certificate: its start, its health check, and SIGHUP.

use super::certificates::{Authority, Files, kinds};
use super::client::{Client, trusting};
use crate::program::{self, Program};
use bagtrack_testing::within::within;
use rustix::process::Signal;
use std::path::Path;
use std::process::Output;
use tokio::process::Command;

fn command(certificate: &Path, key: &Path) -> std::process::Command {
    let mut command = program::serve(env!("CARGO_BIN_EXE_bagtrack").as_ref());
    command.args(["--shutdown-delay", "0s"]);
    command.arg("--tls-cert").arg(certificate);
    command.arg("--tls-key").arg(key);
    command
}

/// `bagtrack serve` with this certificate.
pub fn serve(certificate: &Path, key: &Path) -> Program {
    let program = Program::spawn(&mut command(certificate, key)).unwrap();
    assert!(program.url("").starts_with("https://"));
    program
}

/// The certificate that the service presents to a new client.
async fn shown(authority: &Authority, program: &Program) -> Vec<u8> {
    let connector = trusting(&authority.root, &[]);
    let mut client = Client::open(&connector, program.address).await;
    assert_eq!(client.call("GET", "/healthz", b"").await.status(), "200");
    let chain = client.0.get_ref().1.peer_certificates().unwrap();
    chain[0].to_vec()
}

#[tokio::test]
async fn a_new_certificate_is_read_on_sighup_and_a_wrong_one_is_left() {
    let authority = Authority::new();
    let files = authority.issue(kinds()[0].1);
    let mut program = serve(&files.certificate(), &files.key());
    let first = shown(&authority, &program).await;
    let connector = trusting(&authority.root, &[]);
    let mut old = Client::open(&connector, program.address).await;

    authority.issue_into(&files, kinds()[2].1);
    program.signal(Signal::HUP);
    program.logs("certificate read again");
    let second = shown(&authority, &program).await;
    assert_ne!(first, second);
    assert_eq!(old.call("GET", "/healthz", b"").await.status(), "200");

    // The certificate does not match the key, as between the writes of the two files.
    let other = authority.issue(kinds()[0].1);
    std::fs::copy(other.certificate(), files.certificate()).unwrap();
    program.signal(Signal::HUP);
    let line = program.logs("the certificate stays as it was");
    assert!(line.contains("--tls-key"), "{line}");

    // Reading a pipe without a writer must not block this SIGHUP, nor later ones.
    std::fs::remove_file(files.certificate()).unwrap();
    let mut command = Command::new("mkfifo");
    let made = command.arg(files.certificate()).status().await.unwrap();
    assert!(made.success());
    program.signal(Signal::HUP);
    let line = program.logs("the certificate stays as it was");
    assert!(line.contains("it is no regular file"), "{line}");
    assert_eq!(shown(&authority, &program).await, second);
}

/// Without the warning, only clients would report such a certificate, each in its own words.
#[test]
fn the_log_warns_of_a_certificate_that_clients_refuse_for_its_time() {
    let authority = Authority::new();
    let files = authority.issue(kinds()[0].1);
    authority.issue_for_years(&files, [2019, 2020]);
    let mut program = serve(&files.certificate(), &files.key());
    let said = program.said().join("\n");
    assert!(said.contains("has ended on 2020-01-01T00:00:00Z"), "{said}");
    authority.issue_for_years(&files, [2098, 2099]);
    program.signal(Signal::HUP);
    program.logs("begins on 2098-01-01T00:00:00Z");
    program.logs("certificate read again");
}

#[tokio::test]
async fn the_health_check_speaks_tls_to_a_service_with_a_certificate() {
    let files = Authority::new().issue(kinds()[0].1);
    let program = serve(&files.certificate(), &files.key());
    let listen = program.address.to_string();
    let health = async |arguments: &[&str], variables: &[(&str, &str)]| -> Output {
        let mut command = Command::new(env!("CARGO_BIN_EXE_bagtrack"));
        let command = command
            .arg("health")
            .args(arguments)
            .envs(variables.iter().copied());
        command.output().await.unwrap()
    };
    let certificate = files.certificate().display().to_string();
    // As in a container, whose settings are those of the service.
    let variables = [
        ("BAGTRACK_LISTEN", listen.as_str()),
        ("BAGTRACK_TLS_CERT", certificate.as_str()),
    ];
    let checked = health(&[], &variables).await;
    assert!(checked.status.success(), "{checked:?}");
    let checked = health(&["--url", &format!("https://{listen}")], &[]).await;
    assert!(checked.status.success(), "{checked:?}");
    // The health check does not follow the service to https.
    let checked = health(&["--url", &format!("http://{listen}")], &[]).await;
    let message = String::from_utf8_lossy(&checked.stderr);
    assert!(
        !checked.status.success() && message.contains("307"),
        "{message}"
    );
}

/// The message of the program, which must not start with these files.
async fn refused(certificate: &Path, key: &Path) -> String {
    let mut command = Command::from(command(certificate, key));
    let output = within(command.kill_on_drop(true).output(), "it ends").await;
    let output = output.unwrap();
    assert_eq!(output.status.code(), Some(1), "{output:?}");
    String::from_utf8(output.stderr).unwrap()
}

#[tokio::test]
async fn a_certificate_that_cannot_be_used_is_named_with_the_cure() {
    let authority = Authority::new();
    let (files, other) = (authority.issue(kinds()[0].1), authority.issue(kinds()[1].1));
    let (certificate, key) = (files.certificate(), files.key());
    let missing = files.folder().join("missing.pem");
    let encrypted = files.folder().join("encrypted.pem");
    let text = "-----BEGIN ENCRYPTED PRIVATE KEY-----\nAAAA\n-----END ENCRYPTED PRIVATE KEY-----\n";
    std::fs::write(&encrypted, text).unwrap();
    let damaged = files.folder().join("damaged.pem");
    std::fs::write(
        &damaged,
        "-----BEGIN CERTIFICATE-----\n%%%%\n-----END CERTIFICATE-----\n",
    )
    .unwrap();
    let garbage = files.folder().join("garbage.pem");
    std::fs::write(
        &garbage,
        "-----BEGIN CERTIFICATE-----\nAAAA\n-----END CERTIFICATE-----\n",
    )
    .unwrap();
    for (certificate, key, words) in [
        (
            &missing,
            &key,
            &["missing.pem (--tls-cert) cannot be read", "No such file"][..],
        ),
        (
            &certificate,
            &missing,
            &["missing.pem (--tls-key) cannot be read"],
        ),
        (
            &certificate,
            &encrypted,
            &["encrypted.pem (--tls-key)", "passphrase", "openssl pkey"],
        ),
        (
            &key,
            &key,
            &["key.pem (--tls-cert) has no certificate", "openssl x509"],
        ),
        (
            &damaged,
            &key,
            &["damaged.pem (--tls-cert) has no certificate"],
        ),
        (
            &garbage,
            &key,
            &["garbage.pem (--tls-cert) and ", "cannot be used together"],
        ),
        (
            &certificate,
            &certificate,
            &["certificate.pem (--tls-key) has no private key"],
        ),
        (
            &certificate,
            &other.key(),
            &["cannot be used together", "must be that of the key"],
        ),
    ] {
        let message = refused(certificate, key).await;
        for word in words {
            assert!(message.contains(word), "{word}: {message}");
        }
    }
}

#[tokio::test]
async fn a_certificate_needs_its_key() {
    let files: Files = Authority::new().issue(kinds()[0].1);
    for (flag, file, other) in [
        ("--tls-cert", files.certificate(), "--tls-key"),
        ("--tls-key", files.key(), "--tls-cert"),
    ] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_bagtrack"));
        command
            .args(["serve", "--listen", "127.0.0.1:0", flag])
            .arg(file);
        let output = within(command.kill_on_drop(true).output(), "it ends").await;
        let output = output.unwrap();
        let message = String::from_utf8_lossy(&output.stderr);
        assert!(
            !output.status.success() && message.contains(other),
            "{message}"
        );
    }
}
