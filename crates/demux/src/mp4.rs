//! MP4 and MOV (ISO/IEC 14496-12).

use crate::{DemuxError, Index, Sample, VP9};
use re_mp4::{Mp4, StsdBoxContent, Track, TrackKind};
use std::io::{Read, Seek};

/// The first two columns and rows of the matrix in a track's header, in 16.16 fixed point, and by how many degrees
/// clockwise they turn the pictures.
const TURNS: [([i32; 4], u16); 4] = {
    const ONE: i32 = 1 << 16;
    [
        ([ONE, 0, 0, ONE], 0),
        ([0, ONE, -ONE, 0], 90),
        ([-ONE, 0, 0, -ONE], 180),
        ([0, -ONE, ONE, 0], 270),
    ]
};
/// The media time of an edit that shows nothing for a while: -1, in 32 or in 64 bits.
const EMPTY: [u64; 2] = [u32::MAX as u64, u64::MAX];

pub fn index<R: Read + Seek>(reader: R, size: u64) -> Result<Index, DemuxError> {
    let mp4 = Mp4::read(reader, size)?;
    let is_video = |track: &&Track| track.kind == Some(TrackKind::Video);
    let track = mp4.tracks().values().find(is_video);
    let track = track.ok_or(DemuxError::NoPictures)?;
    let trak = track.trak(&mp4);
    let matrix = &trak.tkhd.matrix;
    let matrix = [matrix.a, matrix.b, matrix.c, matrix.d];
    let turn = TURNS.iter().find(|(turned, _)| *turned == matrix);
    let content = &trak.mdia.minf.stbl.stsd.contents;
    let codec = match content {
        // Some files tell no level.
        StsdBoxContent::Vp09(_) => Some(VP9.to_owned()),
        content => content.codec_string(),
    };
    let needs_description = matches!(
        content,
        StsdBoxContent::Avc1(_) | StsdBoxContent::Hvc1(_) | StsdBoxContent::Hev1(_)
    );
    let edit = Edit::of(&mp4, track)?;
    Ok(Index {
        codec: codec.ok_or_else(|| DemuxError::Codec("a codec of another kind".to_owned()))?,
        description: track.raw_codec_config(&mp4).filter(|_| needs_description),
        rotation: turn.ok_or(DemuxError::Turned)?.1,
        samples: samples(&mp4, track, &edit)?,
    })
}

fn samples(mp4: &Mp4, track: &Track, edit: &Edit) -> Result<Vec<Sample>, DemuxError> {
    let shifts = shifts(mp4, track);
    let sample = |(of, shift): (&re_mp4::Sample, i64)| {
        // A negative offset in a fragment comes as 2^32 plus the offset.
        let offset = (of.composition_timestamp - of.decode_timestamp) as i32;
        let shown = of.decode_timestamp + shift + i64::from(offset);
        let time = edit.delay + edit.micros(shown - edit.begin);
        Ok(Sample {
            offset: of.offset,
            size: u32::try_from(of.size).map_err(|_| DemuxError::Order)?,
            time,
            is_key: of.is_sync,
            is_shown: time >= edit.delay && edit.end.is_none_or(|end| time < end),
        })
    };
    track.samples.iter().zip(shifts).map(sample).collect()
}

/// How much later each sample is decoded than `re_mp4` says, by the durations of the samples before it: each fragment
/// tells when it begins, and `re_mp4` reads the beginning of the first fragment only.
fn shifts(mp4: &Mp4, track: &Track) -> Vec<i64> {
    let fragments = mp4.moofs.iter().flat_map(|moof| &moof.trafs);
    let fragments = fragments.filter(|traf| traf.tfhd.track_id == track.track_id);
    let counted = fragments.map(|traf| {
        let counts = traf.truns.iter().map(|run| run.sample_count as usize);
        (counts.sum(), &traf.tfdt)
    });
    let counted: Vec<(usize, _)> = counted.collect();
    let in_fragments = counted.iter().map(|(count, _)| count).sum();
    let mut shifts = vec![0; track.samples.len().saturating_sub(in_fragments)];
    for (count, begin) in counted {
        let told = track
            .samples
            .get(shifts.len())
            .map_or(0, |first| first.decode_timestamp);
        let begin = begin
            .as_ref()
            .map(|it| it.base_media_decode_time.cast_signed());
        let shift = begin.map_or_else(|| shifts.last().copied().unwrap_or(0), |begin| begin - told);
        shifts.extend(std::iter::repeat_n(shift, count));
    }
    shifts
}

/// The part of a track that is shown.
struct Edit {
    timescale: i64,
    /// When the part begins to be shown, in microseconds.
    delay: i64,
    /// The time in the track that is shown first. `composition_timestamp` counts from the track's first picture.
    begin: i64,
    /// When the part ends, in microseconds.
    end: Option<i64>,
}

impl Edit {
    fn of(mp4: &Mp4, track: &Track) -> Result<Self, DemuxError> {
        let trak = track.trak(mp4);
        let timescale = i64::try_from(track.timescale).unwrap_or(0).max(1);
        let offsets = trak.mdia.minf.stbl.ctts.as_ref();
        let first_offset = offsets.and_then(|ctts| ctts.entries.first());
        let first = track.samples.first().ok_or(DemuxError::NoPictures)?;
        // Samples in fragments keep their own times.
        let first_picture = match mp4.moofs.is_empty() {
            true => {
                first_offset.map_or(0, |it| i64::from(it.sample_offset))
                    - first.composition_timestamp
            }
            false => 0,
        };
        let mut edit = Self {
            timescale,
            delay: 0,
            begin: -first_picture,
            end: None,
        };
        let list = trak.edts.as_ref().and_then(|edts| edts.elst.as_ref());
        let mut entries = list.map_or(&[][..], |elst| &elst.entries);
        let movie_timescale = u64::from(mp4.moov.mvhd.timescale.max(1));
        let micros =
            |duration: u64| (duration.saturating_mul(1_000_000) / movie_timescale).cast_signed();
        if let [empty, rest @ ..] = entries
            && EMPTY.contains(&empty.media_time)
        {
            edit.delay = micros(empty.segment_duration);
            entries = rest;
        }
        match entries {
            [] => Ok(edit),
            [shown] if shown.media_rate == 1 && !EMPTY.contains(&shown.media_time) => {
                edit.begin += shown.media_time.cast_signed();
                // A duration of zero means the rest of the track.
                let duration = (shown.segment_duration > 0).then_some(shown.segment_duration);
                edit.end = duration.map(|duration| edit.delay + micros(duration));
                Ok(edit)
            }
            _ => Err(DemuxError::Edited),
        }
    }

    /// Microseconds of a time of the track, rounded.
    fn micros(&self, time: i64) -> i64 {
        let micros = i128::from(time) * 1_000_000;
        let scale = i128::from(self.timescale);
        i64::try_from((micros + scale / 2).div_euclid(scale)).unwrap_or(i64::MAX)
    }
}
