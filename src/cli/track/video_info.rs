//! What ffprobe tells about a video: its rate, and when each of its frames is shown.

use std::io;
use std::ops::Range;
use std::path::Path;
use std::process::Command;

/// The program that decodes and encodes videos.
pub const FFMPEG: &str = "ffmpeg";
/// The program that tells about videos.
const FFPROBE: &str = "ffprobe";
/// The first names of formats whose files have an index.
const INDEXED: [&str; 2] = ["mov", "matroska"];
/// Frames whose times differ by no more than this, in seconds, count as shown at once. Recordings that note the times
/// of arrival have such frames.
const AT_ONCE: f64 = 1e-4;
/// The greatest numerator and denominator of a rate that encoders of MPEG-4 take.
const MAX_PART: u32 = 65535;

/// Frames a second, as a fraction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Rate {
    numerator: u32,
    denominator: u32,
}

/// What is known about a video.
#[derive(Debug, Default)]
pub struct VideoInfo {
    /// Frames a second, on average.
    pub rate: Rate,
    /// When each frame is shown, in seconds; empty unless it is known for all.
    times: Vec<f64>,
    /// The start time, in seconds, of a file with an index, in which ffmpeg can seek to any frame; `None` for other
    /// files.
    indexed_from: Option<f64>,
}

impl Default for Rate {
    /// The rate of frames without times: 25 a second.
    fn default() -> Self {
        Self {
            numerator: 25,
            denominator: 1,
        }
    }
}

impl Rate {
    /// Reads a fraction as ffprobe writes it. A fraction with large parts, like the average rate of a phone's video, is
    /// rounded to thousandths.
    fn parse(text: &str) -> Option<Self> {
        let (numerator, denominator) = text.split_once('/')?;
        let [numerator, denominator] = [numerator.parse().ok()?, denominator.parse().ok()?];
        let exact = Self {
            numerator,
            denominator,
        };
        if numerator == 0 || denominator == 0 {
            return None;
        }
        if numerator.max(denominator) <= MAX_PART {
            return Some(exact);
        }
        let denominator = if exact.value() < 65.0 { 1000 } else { 1 };
        let numerator = (exact.value() * f64::from(denominator)).round() as u32;
        (1..=MAX_PART).contains(&numerator).then_some(Self {
            numerator,
            denominator,
        })
    }

    /// The numerator and the denominator.
    pub fn parts(self) -> (u32, u32) {
        (self.numerator, self.denominator)
    }

    pub fn value(self) -> f64 {
        f64::from(self.numerator) / f64::from(self.denominator)
    }
}

impl VideoInfo {
    /// What ffprobe tells about the video at `path`; defaults where it cannot, which a warning on standard error says.
    pub fn read(path: &Path) -> Self {
        Self::told(path).unwrap_or_else(|error| {
            let rate = Rate::default().value();
            eprintln!(
                "bagtrack: times are counted with {rate} frames a second, for want of {FFPROBE} ({error}): install it, it \
                 comes with {FFMPEG}"
            );
            Self::default()
        })
    }

    fn told(path: &Path) -> io::Result<Self> {
        let told = ask(path, "packet=pts,flags")?;
        let (info, packets) = Self::parse(&told);
        // Some packets of VP8 are of pictures that are not shown, and nothing tells which.
        let is_vp8 = told.lines().any(|line| line.starts_with("stream,vp8,"));
        match are_frames(&packets) && !is_vp8 {
            true => Ok(info),
            // The frames have to be decoded to know their times.
            false => Ok(Self::parse(&ask(path, "frame=pts")?).0),
        }
    }

    /// Reads lines like `packet,512,K__` or `frame,512`, `stream,h264,25/1,1/12800` and `format,"mov,mp4",0.000000`.
    /// Returns the times in the order of the lines, too. They are computed from whole ticks, since ffprobe truncates
    /// seconds to microseconds.
    fn parse(told: &str) -> (Self, Vec<Option<f64>>) {
        let fields = |line: &str| line.split(',').map(str::to_owned).collect::<Vec<_>>();
        let mut ticks = Vec::new();
        let (mut rate, mut tick) = (None, None);
        let mut indexed_from = None;
        for line in told.lines().map(fields) {
            match line.iter().map(String::as_str).collect::<Vec<_>>()[..] {
                // A packet that an edit list leaves out is decoded, but not shown.
                ["packet", _, flags, ..] if flags.contains('D') => {}
                ["packet" | "frame", count, ..] => ticks.push(count.parse::<f64>().ok()),
                ["stream", _, fraction, base, ..] => {
                    rate = Rate::parse(fraction);
                    tick = base.split_once('/').and_then(|(over, under)| {
                        Some((over.parse::<f64>().ok()?, under.parse::<f64>().ok()?))
                    });
                }
                ["format", name, .., start] if INDEXED.contains(&name.trim_matches('"')) => {
                    indexed_from = start.parse().ok();
                }
                _ => {}
            }
        }
        let seconds = |count: &Option<f64>| {
            let (over, under) = tick?;
            Some((*count)? * over / under)
        };
        let told_times: Vec<_> = ticks.iter().map(seconds).collect();
        let all: Option<Vec<f64>> = told_times.iter().copied().collect();
        let mut times = all.unwrap_or_default();
        times.sort_by(f64::total_cmp);
        let info = Self {
            rate: rate.unwrap_or_default(),
            times,
            indexed_from,
        };
        (info, told_times)
    }

    /// Where to seek for frame `index`: the number of the frame at which decoding begins, and the range of seconds
    /// after the file's start time in which that frame is shown. It is the first of the frames that are shown at once
    /// with `index`, since ffmpeg tells frames apart by their times. The range ends between this frame and its
    /// neighbours, nearer to this frame, since ffmpeg rounds to the file's ticks. `None` where the file has to be
    /// decoded from its beginning.
    pub fn seek_to(&self, index: u64) -> Option<(u64, Range<f64>)> {
        let of_index = self.times.get(usize::try_from(index).ok()?)?;
        let first = self
            .times
            .partition_point(|time| *time < of_index - AT_ONCE);
        let before = self.times.get(first.checked_sub(1)?)?;
        let own = self.times[first];
        let after = self.times.partition_point(|time| *time < own + AT_ONCE);
        let after = self.times.get(after).unwrap_or(&f64::INFINITY);
        let start = self.indexed_from?;
        let range = (before + 3.0 * own) / 4.0 - start..(own + after) / 2.0 - start;
        Some((first as u64, range))
    }

    /// How many frames there are, where that is known.
    pub fn count(&self) -> Option<u64> {
        (!self.times.is_empty()).then_some(self.times.len() as u64)
    }

    /// When frame `index` is shown, in seconds after the first one, to a microsecond.
    pub fn time(&self, index: u64) -> f64 {
        let known = usize::try_from(index).ok();
        let known = known.and_then(|index| Some(self.times.get(index)? - self.times[0]));
        let seconds = known.unwrap_or(index as f64 / self.rate.value());
        (seconds * 1e6).round() / 1e6
    }

    /// The first frame that is not before this time.
    pub fn frame_at(&self, seconds: f64) -> u64 {
        match self.times.first() {
            // Where all frames are before the time, this is the number of frames, which no frame has.
            Some(first) => {
                self.times
                    .partition_point(|time| time - first < seconds - 1e-6) as u64
            }
            None => (seconds * self.rate.value() - 1e-6).ceil().max(0.0) as u64,
        }
    }
}

/// ffprobe's output for the video at `path`; `each` names the fields of each packet or frame.
fn ask(path: &Path, each: &str) -> io::Result<String> {
    let mut command = Command::new(FFPROBE);
    command.args(["-v", "error", "-select_streams", "V:0", "-of", "csv"]);
    let entries =
        format!("format=format_name,start_time:stream=codec_name,avg_frame_rate,time_base:{each}");
    command.args(["-show_entries", &entries]).arg(path);
    Ok(String::from_utf8_lossy(&command.output()?.stdout).into_owned())
}

/// Whether packets with these times are the frames that are shown. Where a video was cut, its first packets may be of
/// pictures that cannot be decoded, and some may have no time. Where no packet has a time, frames have none either.
fn are_frames(times: &[Option<f64>]) -> bool {
    let Some(Some(first)) = times.first() else {
        return times.iter().all(Option::is_none);
    };
    times
        .iter()
        .all(|time| time.is_some_and(|time| time >= *first))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_in_the_order_of_showing_and_count_from_the_first() {
        // Packets are not in the order of showing, because of B-frames. An edit list cuts off the first packet.
        let told =
            "packet,9,KD_\npacket,10,K__\npacket,12,___\npacket,11,___\nstream,h264,10/1,1/10\n";
        let (info, packets) = VideoInfo::parse(told);
        assert!(are_frames(&packets));
        assert_eq!(info.count(), Some(3));
        assert_eq!(
            [0, 1, 2, 5].map(|index| info.time(index)),
            [0.0, 0.1, 0.2, 0.5]
        );
        let at = |seconds| info.frame_at(seconds);
        assert_eq!((at(0.0), at(0.1), at(0.11), at(0.3)), (0, 1, 2, 3));
    }

    /// In thirtieths of a second; ffprobe gives 0.066667 and 2.133333 for these times.
    #[test]
    fn times_after_a_first_one_that_is_not_0_are_rounded_once() {
        let (info, _) = VideoInfo::parse("packet,2,K__\npacket,64,___\nstream,h264,30/1,1/30\n");
        assert_eq!(info.time(1), 2.066667);
    }

    #[test]
    fn a_frame_of_an_indexed_file_is_found_by_a_time_between_it_and_the_one_before() {
        let packets =
            "packet,10,K__\npacket,11,___\npacket,14,___\npacket,14,___\nstream,h264,10/1,1/10\n";
        let seek_to = |format: &str| {
            let (info, _) = VideoInfo::parse(&format!("{packets}{format}\n"));
            let round = |time: f64| (time * 1e6).round() / 1e6;
            [0, 1, 2, 3, 4].map(|index| {
                let found = info.seek_to(index);
                found.map(|(first, range)| (first, round(range.start), round(range.end)))
            })
        };
        let at_once = Some((2, 0.325, f64::INFINITY));
        let expected = [None, Some((1, 0.075, 0.25)), at_once, at_once, None];
        assert_eq!(seek_to("format,\"mov,mp4,m4a\",1.000000"), expected);
        assert_eq!(seek_to("format,\"matroska,webm\",1.000000"), expected);
        assert_eq!(seek_to("format,avi,1.000000"), [None; 5]);
        assert_eq!(seek_to("format,\"matroska,webm\",N/A"), [None; 5]);
    }

    #[test]
    fn without_times_the_rate_tells() {
        let (info, packets) =
            VideoInfo::parse("packet,N/A,K__\npacket,4,___\nstream,h264,30000/1001,1/100\n");
        assert!(!are_frames(&packets));
        assert_eq!((info.count(), info.time(30)), (None, 1.001));
        assert_eq!((info.frame_at(1.001), info.frame_at(1.0)), (30, 30));
        assert_eq!(VideoInfo::parse("").0.time(50), 2.0);
    }

    #[test]
    fn a_rate_has_parts_that_encoders_take() {
        let rate = |text| Rate::parse(text).map(Rate::parts);
        assert_eq!(rate("30000/1001"), Some((30000, 1001)));
        assert_eq!(rate("10530000/350767"), Some((30020, 1000)));
        assert_eq!(rate("12000000/100001"), Some((120, 1)));
        assert_eq!(
            (rate("0/0"), rate("N/A"), rate("90000/1")),
            (None, None, None)
        );
    }
}
