//! The index of files that ffmpeg made, beside what ffprobe tells of them.

use bagtrack_demux::{DemuxError, Index, Sample, index};
use std::fs::File;
use std::io::{Cursor, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::process::Command;

const H264: &str = "-c:v libx264 -preset veryfast -x264-params bframes=3:b-adapt=0:keyint=12";
const VP8: &str = "-c:v libvpx -deadline realtime";
const VP9: &str = "-c:v libvpx-vp9 -deadline realtime -cpu-used 8";
const FRAGMENTS: &str = "-movflags frag_keyframe+empty_moov+default_base_moof";
/// Fragments with negative offsets: their pictures are shown before the time at which they are decoded.
const NEGATIVE: &str = "-movflags frag_keyframe+empty_moov+negative_cts_offsets";
const SOUND: &str = "-f lavfi -i sine=duration=2 -c:a aac";

#[derive(Debug)]
struct Packet {
    time: i64,
    is_key: bool,
    crc32: u32,
}

/// A video of 50 frames without those, from the third on, whose number is divisible by three.
fn made(folder: &Path, name: &str, options: &[&str]) -> PathBuf {
    let path = folder.join(name);
    let source = "-v error -f lavfi -i testsrc=size=128x96:rate=25:duration=2";
    let varying = "-vf select='lt(n,2)+mod(n,3)' -fps_mode vfr -pix_fmt yuv420p";
    let (sound, rest): (Vec<&str>, Vec<&str>) = options.iter().partition(|it| **it == SOUND);
    let flags = [&[source][..], &sound, &[varying], &rest].concat();
    let status = Command::new("ffmpeg")
        .args(flags.iter().flat_map(|flags| flags.split(' ')))
        .arg(&path)
        .status()
        .expect("ffmpeg runs");
    assert!(status.success(), "{name}");
    path
}

fn ffprobe(path: &Path, entries: &str) -> Vec<Vec<String>> {
    let flags = "-v error -select_streams v -show_data_hash CRC32 -of csv=p=0 -show_entries";
    let output = Command::new("ffprobe")
        .args(flags.split(' '))
        .arg(entries)
        .arg(path)
        .output()
        .expect("ffprobe runs");
    let text = String::from_utf8(output.stdout).expect("its output is text");
    let fields = |line: &str| line.split(',').map(str::to_owned).collect();
    text.lines().map(fields).collect()
}

/// What ffprobe tells of the packets.
fn packets(path: &Path) -> Vec<Packet> {
    let packet = |fields: &Vec<String>| Packet {
        time: (fields[0].parse::<f64>().expect("a time") * 1e6).round() as i64,
        is_key: fields[1].starts_with('K'),
        crc32: u32::from_str_radix(&fields[2]["CRC32:".len()..], 16).expect("a checksum"),
    };
    let lines = ffprobe(path, "packet=pts_time,flags,data_hash");
    // Shorter lines tell of the side data of a packet.
    { lines.iter() }
        .filter(|line| line.len() >= 3)
        .map(packet)
        .collect()
}

/// What the index tells of the packets.
fn of(index: &Index, path: &Path) -> Vec<Packet> {
    let bytes = std::fs::read(path).expect("it can be read");
    let packet = |it: &Sample| {
        let begin = usize::try_from(it.offset).expect("it is in the file");
        Packet {
            time: it.time,
            is_key: it.is_key,
            crc32: crc32fast::hash(&bytes[begin..begin + it.size as usize]),
        }
    };
    index.samples.iter().map(packet).collect()
}

/// When pictures are shown, ascending.
fn shown(index: &Index) -> Vec<i64> {
    let shown = index.samples.iter().filter(|sample| sample.is_shown);
    let mut times: Vec<i64> = shown.map(|sample| sample.time).collect();
    times.sort_unstable();
    times
}

/// Whether the packets are the same; times may differ by the microsecond to which ffprobe rounds.
fn agree(told: &[Packet], found: &[Packet]) -> bool {
    let near = |(one, other): (&Packet, &Packet)| {
        (one.time - other.time).abs() <= 1 && (one.is_key, one.crc32) == (other.is_key, other.crc32)
    };
    told.len() == found.len() && told.iter().zip(found).all(near)
}

#[test]
#[ignore = "needs ffmpeg"]
fn the_samples_of_each_kind_of_file_are_those_that_ffprobe_tells() {
    let folder = tempfile::tempdir().expect("a folder");
    let live = "-live 1 -cluster_time_limit 300";
    let vp8 = format!("{VP8} -cpu-used 8 -g 12");
    let cases: [(&str, &[&str], &str); 9] = [
        ("h264.mp4", &[H264, SOUND], "avc1."),
        ("h264.mov", &[H264], "avc1."),
        ("begin.mp4", &[H264, "-movflags faststart"], "avc1."),
        ("fragments.mp4", &[H264, FRAGMENTS, SOUND], "avc1."),
        ("h264.mkv", &[H264, SOUND], "avc1."),
        ("vp9.mp4", &[VP9], "vp09."),
        ("vp9.webm", &[VP9], "vp09."),
        ("vp8.webm", &[&vp8], "vp8"),
        ("live.webm", &[&vp8, live], "vp8"),
    ];
    for (name, options, codec) in cases {
        let path = made(folder.path(), name, options);
        let index = index(File::open(&path).expect("it is there")).expect(name);
        assert!(index.codec.starts_with(codec), "{name}: {}", index.codec);
        assert_eq!(index.description.is_some(), codec == "avc1.", "{name}");
        assert_eq!(index.rotation, 0, "{name}");
        assert!(index.samples.iter().all(|sample| sample.is_shown), "{name}");
        let (told, found) = (packets(&path), of(&index, &path));
        assert!(agree(&told, &found), "{name}: {told:#?} {found:#?}");
        assert_eq!(found.len(), 34, "{name}");
    }
}

/// ffprobe counts the times of such files from the first decoding, so the index is compared with the times that the
/// file was made with.
#[test]
#[ignore = "needs ffmpeg"]
fn pictures_in_fragments_may_be_shown_before_they_are_decoded() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = made(folder.path(), "negative.mp4", &[H264, NEGATIVE]);
    let index = index(File::open(&path).expect("it is there")).expect("an index");
    let made = (0..50)
        .filter(|frame| *frame < 2 || frame % 3 > 0)
        .map(|frame| frame * 40_000);
    assert_eq!(shown(&index), made.collect::<Vec<i64>>());
}

/// Makes the fragments after the first begin later.
fn delay_fragments(path: &Path) {
    let mut bytes = std::fs::read(path).expect("it can be read");
    let boxes = bytes.windows(4).enumerate();
    let begins: Vec<usize> = boxes
        .filter(|(_, name)| name == b"tfdt")
        .map(|(at, _)| at)
        .collect();
    assert!(begins.len() >= 3, "{begins:?}");
    for begin in &begins[1..] {
        // The time has 64 bits, after the box's name, version and flags.
        let time = &mut bytes[begin + 8..begin + 16];
        let later = u64::from_be_bytes((&*time).try_into().expect("eight")) + 5000;
        time.copy_from_slice(&later.to_be_bytes());
    }
    std::fs::write(path, bytes).expect("it can be written");
}

/// Chrome records files in which a fragment begins later than the one before it ends.
#[test]
#[ignore = "needs ffmpeg"]
fn a_fragment_tells_when_it_begins() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = made(folder.path(), "gap.mp4", &[H264, FRAGMENTS]);
    delay_fragments(&path);
    let index = index(File::open(&path).expect("it is there")).expect("an index");
    let (told, found) = (packets(&path), of(&index, &path));
    assert!(agree(&told, &found), "{told:#?} {found:#?}");
}

#[test]
#[ignore = "needs ffmpeg"]
fn a_turned_video_tells_how_far() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = made(folder.path(), "flat.mp4", &[H264]);
    let bytes = std::fs::read(path).expect("it can be read");
    let header = bytes.windows(4).position(|name| name == b"tkhd");
    // The box's version, flags, times, number, duration, layer, group and volume stand before the matrix.
    let matrix = header.expect("a track has a header") + 4 + 40;
    let turned = |a: i32, b: i32, c: i32, d: i32| {
        let mut bytes = bytes.clone();
        for (place, value) in [(0, a), (4, b), (12, c), (16, d)] {
            let at = matrix + place;
            bytes[at..at + 4].copy_from_slice(&(value << 16).to_be_bytes());
        }
        index(Cursor::new(bytes))
    };
    let rotation = |index: Result<Index, DemuxError>| index.expect("an index").rotation;
    assert_eq!(rotation(turned(0, 1, -1, 0)), 90);
    assert_eq!(rotation(turned(-1, 0, 0, -1)), 180);
    assert_eq!(rotation(turned(0, -1, 1, 0)), 270);
    let mirrored = turned(-1, 0, 0, 1);
    assert!(matches!(mirrored, Err(DemuxError::Turned)), "{mirrored:?}");
}

#[test]
#[ignore = "needs ffmpeg"]
fn a_trimmed_video_shows_what_is_left_of_it() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = made(folder.path(), "whole.mp4", &[H264]);
    let trimmed = folder.path().join("trimmed.mp4");
    // Cut within a group of pictures: ffmpeg keeps the group's earlier pictures, and an edit list hides them.
    let status = Command::new("ffmpeg")
        .args(["-v", "error", "-ss", "0.8", "-i"])
        .arg(&path)
        .args(["-c", "copy"])
        .arg(&trimmed)
        .status()
        .expect("ffmpeg runs");
    assert!(status.success());
    let index = index(File::open(&trimmed).expect("it is there")).expect("an index");
    let shown = shown(&index);
    assert!(
        shown.len() < index.samples.len(),
        "none is cut off: {shown:?}"
    );
    let told = ffprobe(&trimmed, "frame=pts_time");
    let told = told
        .iter()
        .map(|fields| fields[0].parse::<f64>().expect("a time"));
    let told: Vec<i64> = told.map(|time| (time * 1e6).round() as i64).collect();
    assert_eq!(told.len(), shown.len(), "{told:?} {shown:?}");
    assert!(
        told.iter()
            .zip(&shown)
            .all(|(told, shown)| (told - shown).abs() <= 1)
    );
}

#[test]
#[ignore = "needs ffmpeg"]
fn a_file_that_ends_too_early_is_refused_or_has_the_samples_before() {
    let folder = tempfile::tempdir().expect("a folder");
    for (name, options) in [
        ("whole.webm", &[VP8][..]),
        ("fragments.mp4", &[H264, FRAGMENTS]),
    ] {
        let path = made(folder.path(), name, options);
        let mut bytes = Vec::new();
        let mut file = File::open(&path).expect("it is there");
        file.read_to_end(&mut bytes).expect("it can be read");
        file.seek(SeekFrom::Start(0)).expect("it can be gone to");
        let whole = index(file).expect("an index");
        for part in 1..20 {
            bytes.truncate(bytes.len() * (20 - part) / 20);
            let Ok(found) = index(Cursor::new(&bytes)) else {
                continue;
            };
            let end = |sample: &Sample| sample.offset + u64::from(sample.size);
            assert!(
                whole.samples.starts_with(&found.samples),
                "{name}, {} bytes",
                bytes.len()
            );
            assert!(
                found.samples.iter().all(|it| end(it) <= bytes.len() as u64),
                "{name}"
            );
        }
    }
}

#[test]
fn what_is_no_video_is_refused() {
    let refused = |bytes: &[u8]| index(Cursor::new(bytes.to_vec())).expect_err("it is no video");
    assert!(matches!(refused(b""), DemuxError::Io(_)));
    assert!(matches!(
        refused(b"\x1a\x45\xdf\xa3 and no more"),
        DemuxError::Matroska(_)
    ));
    assert!(matches!(
        refused(b"GIF89a, which is a picture that moves"),
        DemuxError::Mp4(_)
    ));
}

/// Two faults of `re_mp4` that the index mends (`docs/upstream/re_mp4.md`).
#[test]
#[ignore = "needs ffmpeg"]
fn re_mp4_alone_misreads_fragments() {
    let folder = tempfile::tempdir().expect("a folder");
    let read = |path: &Path| {
        let bytes = std::fs::read(path).expect("it can be read");
        re_mp4::Mp4::read_bytes(&bytes).expect("it is an MP4 file")
    };
    let is_late = |path: &Path| {
        let mp4 = read(path);
        let mut tracks = mp4.tracks().values();
        tracks.any(|track| {
            track
                .samples
                .iter()
                .any(|it| it.composition_timestamp > 1 << 31)
        })
    };
    let path = made(folder.path(), "negative.mp4", &[H264, NEGATIVE]);
    assert!(is_late(&path), "offsets below zero are read: mended");

    let ends = |path: &Path| {
        let mp4 = read(path);
        let last = |track: &re_mp4::Track| track.samples.last().map(|it| it.decode_timestamp);
        mp4.tracks().values().filter_map(last).max()
    };
    let path = made(folder.path(), "gap.mp4", &[H264, FRAGMENTS]);
    let before = ends(&path);
    delay_fragments(&path);
    assert_eq!(
        ends(&path),
        before,
        "the later fragments tell when they begin: mended"
    );
}

/// A fault of `matroska_demuxer` that its reader, `Buffered`, mends (`docs/upstream/matroska-demuxer.md`).
#[test]
#[ignore = "needs ffmpeg"]
fn matroska_demuxer_alone_takes_an_unknown_size_for_one() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = made(folder.path(), "part.webm", &[VP8]);
    let mut bytes = std::fs::read(&path).expect("it can be read");
    let cluster = [0x1f, 0x43, 0xb6, 0x75];
    let first = bytes
        .windows(4)
        .position(|name| name == cluster)
        .expect("it has a cluster");
    // The cluster's size as recording browsers write it: unknown, in eight bytes.
    let length = bytes[first + 4].leading_zeros() as usize + 1;
    let unknown = [0x01, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff];
    bytes.splice(first + 4..first + 4 + length, unknown);
    // The seek head tells places that are no longer right, so it becomes a void element of the same length.
    let seek_head = [0x11, 0x4d, 0x9b, 0x74];
    let head = bytes.windows(4).position(|name| name == seek_head);
    let head = head.expect("it tells of its parts");
    let size = bytes[head + 4] & 0x7f;
    bytes[head..head + 5].copy_from_slice(&[0xec, 0x10, 0, 0, size]);
    std::fs::write(&path, &bytes).expect("it can be written");
    let file = || File::open(&path).expect("it is there");
    index(file()).expect("an index");
    let alone = matroska_demuxer::MatroskaFile::open(file());
    assert!(alone.is_err(), "the file is opened: mended");
}
