//! The synthetic clip: the ground truth is the drawn card's place, and the events that the clip announces are drawn.

use bagtrack_ingest::{Limits, decode};
use bagtrack_sample::{Clip, Settings};
use bagtrack_tracker::Rect;
use image::RgbImage;

fn clip(seed: u64) -> Clip {
    Clip::new(Settings {
        seed,
        ..Settings::default()
    })
    .expect("the settings are in order")
}

/// Frames in full light with nothing in front of the card.
const PLAIN: [u32; 11] = [0, 9, 18, 27, 36, 73, 80, 115, 126, 137, 149];

/// Whether (x, y) is in `card`, widened by `margin` on each side.
fn near(card: Rect, margin: f64, x: f64, y: f64) -> bool {
    (card.x - margin..card.x + card.width + margin).contains(&x)
        && (card.y - margin..card.y + card.height + margin).contains(&y)
}

/// The left, top, right and bottom edges of the area in which two pictures differ, without the area near `left_out`.
fn bounds(picture: &RgbImage, other: &RgbImage, left_out: Rect) -> [f64; 4] {
    let (width, height) = picture.dimensions();
    let differs = |x: u32, y: u32| {
        let pair = picture
            .get_pixel(x, y)
            .0
            .into_iter()
            .zip(other.get_pixel(x, y).0);
        pair.map(|(a, b)| u32::from(a.abs_diff(b))).sum::<u32>() > 60
            && !near(left_out, 3.0, f64::from(x), f64::from(y))
    };
    // A column or row that crosses the card has more than 12 differing pixels.
    let columns = (0..width).filter(|&x| (0..height).filter(|&y| differs(x, y)).count() > 12);
    let rows = (0..height).filter(|&y| (0..width).filter(|&x| differs(x, y)).count() > 12);
    let ends = |of: Vec<u32>| {
        let (first, last) = (of.first().copied(), of.last().copied());
        let found = first.zip(last).expect("the card is in the picture");
        (f64::from(found.0), f64::from(found.1) + 1.0)
    };
    let ((left, right), (top, bottom)) = (ends(columns.collect()), ends(rows.collect()));
    [left, top, right, bottom]
}

#[test]
fn the_ground_truth_is_where_the_card_is_drawn() {
    let mut checked = 0;
    for seed in 0..3 {
        let clip = clip(seed);
        for index in PLAIN {
            let card = clip.target(index);
            let truth = [card.x, card.y, card.x + card.width, card.y + card.height];
            // Another frame, in which the card is elsewhere, shows the bare wall here.
            let elsewhere = PLAIN
                .into_iter()
                .find(|&other| grown(card).overlap(&clip.target(other)) == 0.0);
            let Some(other) = elsewhere else { continue };
            let seen = bounds(&clip.draw(index), &clip.draw(other), clip.target(other));
            for (seen, truth) in seen.into_iter().zip(truth) {
                // Half a pixel of rounding, and half a pixel that the card may cover without a visible difference.
                assert!(
                    (seen - truth).abs() <= 1.0,
                    "seed {seed}, frame {index}: {seen} for {truth}"
                );
            }
            checked += 1;
        }
    }
    assert!(checked > 20, "only {checked} frames were checked");
}

fn grown(card: Rect) -> Rect {
    let (width, height) = (card.width + 10.0, card.height + 10.0);
    Rect::new(card.x - 5.0, card.y - 5.0, width, height)
}

#[test]
fn the_card_moves_smoothly_turns_and_stays_in_the_frame() {
    let clip = clip(1);
    let center = |index| {
        let card = clip.target(index);
        (card.x + card.width / 2.0, card.y + card.height / 2.0)
    };
    let (mut turns, mut last_step) = (0, 0.0);
    for index in 1..clip.frames() {
        let card = clip.target(index);
        assert!(card.x >= 0.0 && card.y >= 0.0);
        assert!(card.x + card.width <= 320.0 && card.y + card.height <= 240.0);
        let (now, before) = (center(index), center(index - 1));
        let step = (now.0 - before.0).hypot(now.1 - before.1);
        assert!(step < 8.0, "frame {index} jumps by {step} pixels");
        let across = now.0 - before.0;
        turns += i32::from(across * last_step < 0.0);
        last_step = across;
    }
    assert!(turns >= 2, "it turned {turns} times");
}

#[test]
fn it_grows_dims_and_is_half_covered_for_a_while() {
    let clip = clip(0);
    let frames = clip.frames();
    assert!(clip.target(frames - 1).height > 1.4 * clip.target(0).height);
    let brightness = |index| {
        let picture = clip.draw(index);
        let sum: u64 = picture.as_raw().iter().map(|&value| u64::from(value)).sum();
        sum as f64 / picture.as_raw().len() as f64
    };
    assert!(brightness(55) < 0.6 * brightness(0), "it does not dim");
    let half = (0..frames)
        .filter(|&index| (clip.covered(index) - 0.5).abs() < 1e-9)
        .count();
    assert!(half > 8, "half covered for {half} frames only");
    assert_eq!((clip.covered(0), clip.covered(frames - 1)), (0.0, 0.0));
    // The lower half is behind the board: brown, without the card's light border.
    let index = (0..frames)
        .find(|&i| clip.covered(i) == 0.5)
        .expect("it is half covered");
    let (card, picture) = (clip.target(index), clip.draw(index));
    let at = |u: f64, v: f64| {
        let (x, y) = (card.x + u * card.width, card.y + v * card.height);
        picture.get_pixel(x as u32, y as u32).0
    };
    assert!(
        at(0.5, 0.02)[0] > 200 && at(0.5, 0.97)[0] < 160,
        "{:?} {:?}",
        at(0.5, 0.02),
        at(0.5, 0.97)
    );
}

#[test]
fn any_frame_can_be_drawn_by_itself() {
    let (one, other) = (clip(5), clip(5));
    let _ = one.draw(3);
    assert_eq!(one.draw(4), other.draw(4));
}

#[test]
fn written_frames_decode_to_what_was_drawn() {
    let parent = tempfile::tempdir().expect("the system has a place for temporary folders");
    let clip = Clip::new(Settings {
        frames: 2,
        ..Settings::default()
    })
    .expect("the settings are in order");
    clip.write(parent.path(), bagtrack_sample::Format::Png, || ())
        .expect("the folder is writable");
    let bytes = std::fs::read(parent.path().join("img/0002.png")).expect("it was written");
    let frame = decode(&bytes, &Limits::default()).expect("it is a PNG");
    let drawn = clip.draw(1);
    for (luma, pixel) in frame.pixels().iter().zip(drawn.pixels()) {
        let [r, g, b] = pixel.0.map(f64::from);
        assert!((f64::from(*luma) - (0.299 * r + 0.587 * g + 0.114 * b)).abs() <= 1.0);
    }
}
