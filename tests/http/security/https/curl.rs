//! Certificates that openssl makes as docs/HTTPS.md says, and curl as the client.

use super::program::serve;
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// The shell commands of docs/HTTPS.md that make a certificate.
fn documented() -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/HTTPS.md");
    let text = std::fs::read_to_string(path).unwrap();
    let (_, rest) = text.split_once("```sh\nopenssl req").expect("the commands");
    let (commands, _) = rest.split_once("bagtrack serve").expect("they end");
    format!("openssl req{commands}")
}

fn run(command: &mut Command) -> Output {
    let output = command.output().unwrap();
    assert!(output.status.success(), "{command:?}: {output:?}");
    output
}

/// Makes a certificate in `folder` by the commands of the document, with these options for the key.
fn make(folder: &Path, key: &str) -> (PathBuf, PathBuf) {
    let commands = documented().replace("ec -pkeyopt ec_paramgen_curve:prime256v1", key);
    assert!(commands.contains(key), "{commands}");
    run(Command::new("sh")
        .args(["-ec", &commands])
        .current_dir(folder));
    (folder.join("cert.pem"), folder.join("key.pem"))
}

fn curl(certificate: &Path) -> Command {
    let mut command = Command::new("curl");
    command.args(["--silent", "--show-error", "--fail-with-body", "--cacert"]);
    command.arg(certificate);
    command
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
#[ignore = "needs openssl and curl"]
async fn the_certificates_of_openssl_serve_curl_whatever_their_key_is() {
    let clip = tempfile::tempdir().unwrap();
    let sample = clip.path().join("clip");
    let mut command = Command::new(env!("CARGO_BIN_EXE_bagtrack"));
    run(command
        .args(["sample", "--frames", "3", "--out"])
        .arg(&sample));
    for key in [
        "ec -pkeyopt ec_paramgen_curve:prime256v1",
        "ec -pkeyopt ec_paramgen_curve:secp384r1",
        "rsa:2048",
        "rsa:4096",
        "ed25519",
    ] {
        let folder = tempfile::tempdir().unwrap();
        let (certificate, private) = make(folder.path(), key);
        let program = serve(&certificate, &private);
        let url = format!("https://localhost:{}", program.address.port());
        let frame = |number: usize| format!("@{}/img/000{number}.jpg", sample.display());
        let session = format!("{url}/sessions/67e55044-10b1-426f-9247-bb680e5fe0c8");
        let open = format!("{session}?box=44.1,101.4,46.1,57.6&seed=1");
        run(curl(&certificate).args(["-X", "PUT", "--data-binary", &frame(1), &open]));
        let post = format!("{session}/frames");
        let answer = run(curl(&certificate).args(["--data-binary", &frame(2), &post]));
        let answer: Value = serde_json::from_slice(&answer.stdout).unwrap();
        assert_eq!(answer["status"], "tracking", "{key}: {answer}");
        // The certificate also names 127.0.0.1, as in the document; and the service accepts TLS 1.2.
        let by_address = format!("https://{}/healthz", program.address);
        run(curl(&certificate).args(["--tls-max", "1.2", &by_address]));
        let strict = Command::new("curl")
            .args(["--silent", &by_address])
            .output();
        assert_eq!(
            strict.unwrap().status.code(),
            Some(60),
            "nobody known has signed it"
        );
        // An http address, as people type it, redirects to https.
        let plain = format!("http://localhost:{}/healthz", program.address.port());
        run(curl(&certificate).args(["--location", &plain]));
    }
}
