//! What the client keeps of a session, so that it can open it again: an origin, and the frames after it.

use crate::upload::{Origin, Upload};
use std::collections::BTreeMap;

/// Most requests with frames that are kept.
pub const MOST: usize = 256;

/// An origin, and frames. If there is an origin, all frames after it are kept.
#[derive(Debug, Default)]
pub struct Kept {
    origin: Option<Origin>,
    /// By the number of the first frame of each, without gaps.
    uploads: BTreeMap<u64, Upload>,
}

impl Kept {
    pub fn origin(&self) -> Option<&Origin> {
        self.origin.as_ref()
    }

    /// Takes a newer origin, and drops the frames up to it.
    pub fn renew(&mut self, origin: Origin) {
        self.forget_until(origin.frame);
        self.origin = Some(origin);
    }

    /// Keeps the next frames. Drops the oldest over [`MOST`], and with them the origin.
    pub fn put(&mut self, number: u64, upload: Upload) {
        self.uploads.insert(number, upload);
        while self.uploads.len() > MOST {
            self.uploads.pop_first();
            self.origin = None;
        }
    }

    /// The frames from this number on to the end of the request that has it.
    pub fn from(&self, number: u64) -> Option<Upload> {
        let (first, upload) = self.uploads.range(..=number).next_back()?;
        let before = usize::try_from(number - first).ok()?;
        let frames = upload.frames.get(before..)?;
        (!frames.is_empty()).then(|| Upload {
            frames: frames.to_vec(),
            correction: upload.correction,
        })
    }

    /// The number of the newest frame.
    pub fn last(&self) -> Option<u64> {
        let (first, upload) = self.uploads.last_key_value()?;
        Some(upload.last(*first))
    }

    /// Drops the frames up to this one, which a newer origin or the service's store has.
    pub fn forget_until(&mut self, number: u64) {
        self.uploads
            .retain(|first, upload| upload.last(*first) > number);
        self.origin.take_if(|origin| origin.frame < number);
    }

    /// Drops the frames after this one, which the service has refused.
    pub fn forget_after(&mut self, number: u64) {
        self.uploads.retain(|first, _| *first <= number);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bytes::Bytes;

    fn upload(frames: &[u8]) -> Upload {
        Upload {
            frames: frames.iter().map(|&byte| Bytes::from(vec![byte])).collect(),
            correction: None,
        }
    }

    fn origin(frame: u64) -> Origin {
        Origin {
            frame,
            query: Vec::new(),
            media_type: "",
            body: Bytes::new(),
        }
    }

    /// Frames 1, 2 to 4, and 5 after an origin at 0.
    fn kept() -> Kept {
        let mut kept = Kept::default();
        kept.renew(origin(0));
        kept.put(1, upload(&[1]));
        kept.put(2, upload(&[2, 3, 4]));
        kept.put(5, upload(&[5]));
        kept
    }

    #[test]
    fn a_request_with_several_frames_goes_on_in_its_middle() {
        let kept = kept();
        assert_eq!(kept.from(1), Some(upload(&[1])));
        assert_eq!(kept.from(2), Some(upload(&[2, 3, 4])));
        assert_eq!(kept.from(4), Some(upload(&[4])));
        assert_eq!((kept.from(0), kept.from(6)), (None, None));
        assert_eq!(kept.last(), Some(5));
    }

    #[test]
    fn what_a_checkpoint_or_a_refusal_leaves() {
        let mut kept = kept();
        kept.forget_until(3);
        assert_eq!(kept.from(1), None);
        assert_eq!(kept.from(4), Some(upload(&[4])));
        // Frames 1 to 3 are dropped, so the first frame does not suffice to open the session again.
        assert_eq!(kept.origin(), None);
        kept.forget_after(4);
        assert_eq!((kept.from(5), kept.last()), (None, Some(4)));
        kept.renew(origin(4));
        assert_eq!((kept.from(4), kept.last()), (None, None));
        assert_eq!(kept.origin(), Some(&origin(4)));
    }

    #[test]
    fn no_more_than_so_many_are_kept() {
        let mut kept = Kept::default();
        kept.renew(origin(0));
        for number in 1..=MOST as u64 {
            kept.put(number, upload(&[0]));
        }
        assert!(kept.origin().is_some() && kept.from(1).is_some());
        kept.put(MOST as u64 + 1, upload(&[0]));
        assert!(kept.origin().is_none() && kept.from(1).is_none());
        assert!(kept.from(2).is_some());
    }
}
