//! HAProxy and nginx with the configurations that the project ships, on free ports.

use crate::processes::{Process, free_port, wait_for};
use std::net::SocketAddr;
use std::process::Command;
use tempfile::TempDir;

/// A load balancer before the replicas; it ends when this is dropped.
pub struct Balancer {
    _process: Process,
    _folder: TempDir,
    pub address: SocketAddr,
}

/// A configuration of docker/, with each of these texts replaced by another one.
fn shipped(name: &str, changes: &[(&str, String)]) -> String {
    let path = format!("{}/docker/{name}", env!("CARGO_MANIFEST_DIR"));
    let mut text = std::fs::read_to_string(&path).expect("it is shipped");
    for (shipped, other) in changes {
        assert!(text.contains(shipped), "{path}: {shipped}");
        text = text.replace(shipped, other);
    }
    text
}

fn start(command: &mut Command, folder: TempDir, port: u16) -> Balancer {
    let mut process = Process::start(command);
    let address = SocketAddr::from(([127, 0, 0, 1], port));
    wait_for(address, &mut process.0);
    Balancer {
        _process: process,
        _folder: folder,
        address,
    }
}

pub fn haproxy(replicas: &[SocketAddr]) -> Balancer {
    haproxy_with(replicas, &[])
}

/// HAProxy, with further texts of its configuration replaced.
pub fn haproxy_with(replicas: &[SocketAddr], changes: &[(&str, String)]) -> Balancer {
    let (folder, port) = (tempfile::tempdir().unwrap(), free_port());
    let servers = replicas.iter().enumerate();
    let servers =
        servers.map(|(number, address)| format!("server replica{number} {address}\n    "));
    let template = "server-template replica 3 bagtrack:8080 resolvers system init-addr libc,none";
    let own = [
        ("bind :8080", format!("bind 127.0.0.1:{port}")),
        (template, servers.collect()),
    ];
    let text = shipped("haproxy.cfg", &[&own, changes].concat());
    let file = folder.path().join("haproxy.cfg");
    std::fs::write(&file, text).unwrap();
    start(Command::new("haproxy").arg("-f").arg(file), folder, port)
}

pub fn nginx(replicas: &[SocketAddr]) -> Balancer {
    let (folder, port) = (tempfile::tempdir().unwrap(), free_port());
    let server =
        |number: usize| format!("server replica-{number}:8080 max_fails=1 fail_timeout=1s;");
    let of = |number: usize| {
        let address = replicas[number - 1];
        format!("server {address} max_fails=1 fail_timeout=1s;")
    };
    let text = shipped(
        "nginx.conf",
        &[
            ("listen 8080;", format!("listen 127.0.0.1:{port};")),
            (&server(1), of(1)),
            (&server(2), of(2)),
            (&server(3), of(3)),
        ],
    );
    let text = text.replace(
        "/tmp/nginx",
        &folder.path().join("nginx").display().to_string(),
    );
    let file = folder.path().join("nginx.conf");
    std::fs::write(&file, text).unwrap();
    let mut command = Command::new("nginx");
    // One process: if a master were killed, its workers would go on.
    command.arg("-c").arg(file);
    command.args(["-g", "daemon off; master_process off;"]);
    start(&mut command, folder, port)
}
