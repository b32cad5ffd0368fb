//! One process with its store in a folder: it is killed, its disk is full, or another process has the folder.

use crate::chaos::setting;
use crate::clip::Clip;
use crate::replica::Replica;
use crate::tracking_client::Track;
use crate::tracks::{SECRET, Tracks, undisturbed};
use bagtrack_testing::command::program;
use bagtrack_testing::service::program::{Program, serve};
use reqwest::{Client, StatusCode};
use rustix::fs::statvfs;
use rustix::process::{Pid, Resource, Rlimit, prlimit};
use serde_json::Value;
use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;
use tempfile::TempDir;

/// A temporary folder, and the value of `--store` that names it.
fn folder() -> (TempDir, String) {
    let folder = tempfile::tempdir().expect("a folder");
    let setting = format!("file:{}", folder.path().join("sessions").display());
    (folder, setting)
}

/// How often the process is killed.
const KILLS: usize = 6;

/// Clients go on while the process is killed by SIGKILL: no track and no answered frame is lost, and all boxes equal
/// those of an undisturbed run.
async fn goes_on_when_killed(durability: &str, (clients, frames): (usize, usize)) {
    let clips = Clip::of_each(clients, frames);
    let expected = undisturbed(&clips).await;
    let (_folder, store) = folder();
    let flags = [&["--durability", durability], &SECRET[..]].concat();
    let mut replica = Replica::with_store(&store, &flags);
    let mut tracks = Tracks::start(&replica.url(""), &clips, true);
    for kill in 1..=KILLS {
        let frames = kill * clients * frames / (KILLS + 1);
        tracks.reach_together(frames).await;
        tokio::task::block_in_place(|| {
            replica.kill();
            replica.start_again();
        });
    }
    tracks.end_as(&expected).await;
    println!(
        "{clients} clients, {frames} frames each, killed {KILLS} times, durability {durability}"
    );
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_process_that_is_killed_goes_on_from_its_folder() {
    let clients = setting("BAGTRACK_REPLICAS_CLIENTS", 20);
    let frames = setting("BAGTRACK_REPLICAS_FRAMES", 100);
    goes_on_when_killed("250ms", (clients, frames)).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_process_that_syncs_each_answer_goes_on_from_its_folder() {
    goes_on_when_killed("each", (6, 40)).await;
}

/// The message of a process that must not start with these flags.
fn refusal(flags: &[&str]) -> String {
    let mut command = Command::new(program("bagtrack"));
    command
        .args(["serve", "--listen", "127.0.0.1:0"])
        .args(flags);
    let output = command.output().expect("the program is built");
    assert!(!output.status.success(), "{flags:?}: it starts");
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn a_folder_of_another_process_is_refused() {
    let (_folder, store) = folder();
    let _first = Replica::with_store(&store, &[]);
    let text = refusal(&["--store", &store]);
    assert!(text.contains("another process uses the store in"), "{text}");
    assert!(text.contains("--store"), "{text}");
}

#[test]
fn a_setting_that_names_no_store_is_refused() {
    for setting in ["file:", "/var/lib/bagtrack", "http://localhost"] {
        let text = refusal(&["--store", setting]);
        assert!(
            text.contains("must be file:DIR, or an address like redis://"),
            "{text}"
        );
    }
    let text = refusal(&["--store", "file:/dev/null/sessions"]);
    assert!(
        text.contains("/dev/null/sessions cannot be opened"),
        "{text}"
    );
    for durability in ["never", "0s", "2h"] {
        let text = refusal(&["--durability", durability]);
        assert!(text.contains("each, or a time from 1ms to 1h"), "{text}");
    }
}

/// A process with an adjustable limit on the size of its files. Writes beyond it fail as on a full disk.
struct Limited(Program);

impl Limited {
    fn start(store: &str) -> Self {
        let mut command = serve(&program("bagtrack"));
        command.args(["--workers", "2", "--store", store]);
        Self(Program::spawn(command.args(SECRET)).expect("it listens"))
    }

    /// Sets the limit in bytes; `None` removes it.
    fn limit(&self, bytes: Option<u64>) {
        let pid = Pid::from_raw(i32::try_from(self.0.process_id()).unwrap());
        let limit = Rlimit {
            current: bytes,
            maximum: None,
        };
        prlimit(pid, Resource::Fsize, limit).expect("it is a process of ours");
    }

    async fn readiness(&self) -> StatusCode {
        let answer = reqwest::get(self.0.url("/readyz")).await;
        answer.expect("it listens").status()
    }
}

/// A process with its store on a disk in memory, mounted in a namespace of its own.
fn on_a_disk_of(megabytes: usize, folder: &Path) -> Program {
    let mut command = Command::new("unshare");
    command.args(["--map-root-user", "--mount", "sh", "-c"]);
    command.arg("mount -t tmpfs -o size=$1m none \"$2\" && shift 2 && exec \"$@\"");
    command.args(["sh", &megabytes.to_string()]).arg(folder);
    command.arg(program("bagtrack"));
    command.args(["serve", "--listen", "127.0.0.1:0"]);
    let store = format!("file:{}", folder.join("sessions").display());
    command.args(["--store", &store]).args(SECRET);
    Program::spawn(&mut command).expect("there is unshare")
}

#[tokio::test]
#[ignore = "needs Linux and the right to mount a disk in a namespace (unshare)"]
async fn on_a_nearly_full_disk_sessions_are_refused_and_frames_are_taken() {
    let clip = Clip::of(0, 8);
    let folder = tempfile::tempdir().expect("a folder");
    let process = on_a_disk_of(256, folder.path());
    let base = process.url("");
    let mut track = Track::open(base.clone(), Client::new(), 0, clip.clone()).await;
    // The path of the disk, through the process's view of the file system.
    let disk = PathBuf::from(format!("/proc/{}/root", process.process_id()));
    let disk = disk.join(folder.path().strip_prefix("/").unwrap());
    let mut filler = File::create(disk.join("filler")).unwrap();
    let is_nearly_full = || {
        let statistics = statvfs(&disk).unwrap();
        statistics.f_bavail * 16 < statistics.f_blocks
    };
    while !is_nearly_full() {
        filler.write_all(&vec![7; 1 << 20]).unwrap();
    }
    let query = format!("{base}/sessions?box={}", clip.first_box);
    let open = || async {
        let request = Client::new().post(&query).body(clip.frames[0].clone());
        request.send().await.unwrap().status()
    };
    assert_eq!(open().await, StatusCode::SERVICE_UNAVAILABLE);
    while track.advance().await {}
    let is_ready_as = |status: &'static str| {
        let url = format!("{base}/readyz");
        async move {
            let answer = reqwest::get(url).await.unwrap();
            assert_eq!(answer.status(), StatusCode::OK);
            answer.json::<Value>().await.unwrap()["status"] == status
        }
    };
    while !is_ready_as("store-full").await {}
    filler.set_len(0).unwrap();
    assert_eq!(open().await, StatusCode::CREATED);
    while !is_ready_as("ok").await {}
}

/// The bytes of the journal without the zeros at its end.
fn journal_bytes(folder: &TempDir) -> u64 {
    let entries = folder.path().join("sessions").read_dir().unwrap();
    let lengths = entries
        .map(|entry| entry.unwrap().path())
        .filter_map(|path| {
            let is_journal = path.extension().is_some_and(|extension| extension == "jnl");
            let bytes = is_journal.then(|| std::fs::read(path).unwrap())?;
            Some(bytes.iter().rposition(|byte| *byte != 0)? as u64 + 1)
        });
    lengths.max().unwrap()
}

/// Checks that the next frame gets status 503.
async fn refuses_frame(sessions: &str, track: &Track, clip: &Clip) {
    let number = track.answers.len() + 1;
    let url = format!("{sessions}/{}/frames?frame={number}", track.id());
    let post = Client::new().post(url).body(clip.frames[number].clone());
    let refused = post.send().await.unwrap();
    assert_eq!(refused.status(), StatusCode::SERVICE_UNAVAILABLE);
}

/// An empty store in place of the missing one would make all sessions count as lost.
#[tokio::test]
async fn a_folder_whose_disk_has_gone_is_not_made_anew() {
    let clip = Clip::of(0, 12);
    let (answers, _) = undisturbed(std::slice::from_ref(&clip)).await.remove(0);
    let (folder, store) = folder();
    let mut replica = Limited::start(&store);
    let mut track = Track::open(replica.0.url(""), Client::new(), 0, clip.clone()).await;
    while track.answers.len() < 5 {
        track.advance().await;
    }
    // Makes writes fail, as when a disk goes away.
    replica.limit(Some(0));
    refuses_frame(&replica.0.url("/sessions"), &track, &clip).await;
    let (sessions, elsewhere) = (folder.path().join("sessions"), folder.path().join("disk"));
    std::fs::rename(&sessions, &elsewhere).unwrap();
    replica.limit(None);
    replica.0.logs("sessions cannot be opened");
    assert!(!sessions.exists());
    let answer = reqwest::get(replica.0.url("/readyz")).await.unwrap();
    assert_eq!(answer.status(), StatusCode::SERVICE_UNAVAILABLE);
    let told = answer.text().await.unwrap();
    assert!(told.contains("The store of the sessions"), "{told}");
    // The empty mount point is there again, without the disk.
    std::fs::create_dir(&sessions).unwrap();
    replica.0.logs("not there any more");
    std::fs::remove_dir(&sessions).unwrap();
    std::fs::rename(&elsewhere, &sessions).unwrap();
    while replica.readiness().await != StatusCode::OK {}
    while track.advance().await {}
    assert!(!track.went_back());
    assert_eq!(track.answers, answers);
}

/// Frames that are answered with 200 after the removal would be lost.
#[tokio::test]
async fn a_folder_that_is_removed_takes_no_frames() {
    let clip = Clip::of(0, 12);
    let (answers, _) = undisturbed(std::slice::from_ref(&clip)).await.remove(0);
    let (folder, store) = folder();
    let replica = Replica::with_store(&store, &[]);
    let mut track = Track::open(replica.url(""), Client::new(), 0, clip.clone()).await;
    while track.answers.len() < 5 {
        track.advance().await;
    }
    let (sessions, elsewhere) = (
        folder.path().join("sessions"),
        folder.path().join("removed"),
    );
    std::fs::rename(&sessions, &elsewhere).unwrap();
    let told = async { while replica.readiness().await == StatusCode::OK {} };
    let told = tokio::time::timeout(Duration::from_secs(60), told).await;
    told.expect("it is told that the files have gone");
    refuses_frame(&replica.url("/sessions"), &track, &clip).await;
    std::fs::rename(&elsewhere, &sessions).unwrap();
    while replica.readiness().await != StatusCode::OK {}
    while track.advance().await {}
    assert!(!track.went_back());
    assert_eq!(track.answers, answers);
}

#[tokio::test]
async fn on_a_full_disk_frames_are_refused_and_nothing_is_lost() {
    let clip = Clip::of(0, 25);
    let (answers, state) = undisturbed(std::slice::from_ref(&clip)).await.remove(0);
    let (folder, store) = folder();
    let replica = Limited::start(&store);
    let base = replica.0.url("");
    let mut track = Track::open(base, Client::new(), 0, clip.clone()).await;
    for full in [5, 10, 15] {
        while track.answers.len() < full {
            track.advance().await;
        }
        // Room for about one more frame.
        replica.limit(Some(journal_bytes(&folder) + (48 << 10)));
        let url = replica.0.url(&format!("/sessions/{}/frames", track.id()));
        let mut refused = None;
        for number in full + 1.. {
            let request = Client::new().post(format!("{url}?frame={number}"));
            let answer = request
                .body(clip.frames[number].clone())
                .send()
                .await
                .unwrap();
            match answer.status() {
                StatusCode::OK => {}
                status => {
                    refused = Some((status, answer.text().await.unwrap()));
                    break;
                }
            }
        }
        let (status, body) = refused.unwrap();
        assert_eq!(status, StatusCode::SERVICE_UNAVAILABLE, "{body}");
        assert!(body.contains("/docs/problems#store-unavailable"), "{body}");
        while replica.readiness().await != StatusCode::SERVICE_UNAVAILABLE {}
        replica.limit(None);
        while replica.readiness().await != StatusCode::OK {}
    }
    // The client goes on: for a frame that the loop above has sent with success, it gets the stored answer.
    while track.advance().await {}
    assert!(!track.went_back());
    assert_eq!(track.answers, answers);
    assert!(track.snapshot().await == state, "another state");
}
