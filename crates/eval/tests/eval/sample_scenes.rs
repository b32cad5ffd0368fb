//! The clips in which the target goes out of sight: it is drawn in exactly the frames in which the clip says that it is
//! visible.

use bagtrack_cli::read_boxes;
use bagtrack_sample::{Attributes, Clip, Format, Scene, Settings};
use image::RgbImage;

/// Two pictures of the same scene differ by less than this in every channel; the sensor's noise is 2.5 of 255.
const NOISE: u8 = 28;

fn clip(scene: Scene, seed: u64) -> Clip {
    Clip::new(Settings {
        scene,
        seed,
        ..Settings::default()
    })
    .expect("the settings are in order")
}

/// The frames in which the clip says that nothing of the target is visible; they must be consecutive.
fn out_of_sight(clip: &Clip) -> std::ops::Range<u32> {
    let hidden: Vec<u32> = (0..clip.frames())
        .filter(|&index| clip.visible(index) == 0.0)
        .collect();
    let (first, last) = (hidden[0], hidden[hidden.len() - 1]);
    assert_eq!(hidden.len() as u32, last + 1 - first, "{hidden:?}");
    first..last + 1
}

/// Pixels that differ by more than noise.
fn changed(one: &RgbImage, other: &RgbImage) -> usize {
    let pairs = one.pixels().zip(other.pixels());
    pairs
        .filter(|(a, b)| (0..3).any(|channel| a.0[channel].abs_diff(b.0[channel]) > NOISE))
        .count()
}

/// Asserts that the card is invisible in the `hidden` frames, and visible in all others. The card moves in every frame,
/// so two pictures that differ by noise alone show nothing of it.
fn nothing_is_seen_then_and_only_then(clip: &Clip, hidden: std::ops::Range<u32>) {
    let empty = clip.draw(hidden.start);
    for index in hidden.clone() {
        assert_eq!(changed(&empty, &clip.draw(index)), 0, "frame {index}");
    }
    for index in [hidden.start - 2, hidden.end + 1] {
        let strip = clip.visible(index);
        assert!(strip > 0.0 && strip < 0.2, "frame {index}: {strip} is seen");
        assert!(changed(&empty, &clip.draw(index)) > 20, "frame {index}");
    }
    for index in [0, clip.frames() - 1] {
        assert_eq!(clip.visible(index), 1.0);
        let card = clip.target(index).area() as usize;
        let seen = changed(&empty, &clip.draw(index));
        assert!(
            seen > card * 7 / 10 && seen < card * 11 / 10,
            "frame {index}: {seen} pixels of {card} changed"
        );
    }
}

#[test]
fn behind_the_post_nothing_is_seen_for_20_frames() {
    for seed in 0..3 {
        let clip = clip(Scene::Covered, seed);
        let hidden = out_of_sight(&clip);
        assert_eq!(hidden.len(), 20, "seed {seed}");
        nothing_is_seen_then_and_only_then(&clip, hidden.clone());
        // Behind the post the card moves on by more than its own width, and stays in the frame.
        let (before, after) = (clip.target(hidden.start), clip.target(hidden.end));
        assert!((before.x - after.x).abs() > before.width, "seed {seed}");
        for index in 0..clip.frames() {
            let card = clip.target(index);
            assert!(card.x > 0.0 && card.x + card.width < 320.0);
            assert!(card.y > 0.0 && card.y + card.height < 240.0);
        }
    }
}

#[test]
fn outside_the_frame_nothing_is_seen_for_25_frames() {
    for seed in 0..3 {
        let clip = clip(Scene::Leaves, seed);
        let hidden = out_of_sight(&clip);
        assert_eq!(hidden.len(), 25, "seed {seed}");
        nothing_is_seen_then_and_only_then(&clip, hidden.clone());
        let (before, after) = (clip.target(hidden.start - 1), clip.target(hidden.end));
        let (at_left, same) = (before.x < 160.0, after.x < 160.0);
        assert_eq!(at_left, same, "seed {seed}: it came back elsewhere");
        assert!(
            (before.y - after.y).abs() > before.height,
            "seed {seed}: it came back where it left"
        );
        assert_eq!(clip.covered(hidden.start), 0.0);
    }
}

#[test]
fn the_target_never_jumps() {
    for (scene, seed) in [Scene::Covered, Scene::Leaves]
        .into_iter()
        .flat_map(|scene| (0..4).map(move |seed| (scene, seed)))
    {
        let clip = clip(scene, seed);
        for index in 1..clip.frames() {
            let (now, before) = (clip.target(index).center(), clip.target(index - 1).center());
            let step = (now.0 - before.0).hypot(now.1 - before.1);
            assert!(step < 8.0, "{scene:?}, frame {index}: {step} pixels");
        }
    }
}

#[test]
fn seeds_choose_the_side() {
    for scene in [Scene::Covered, Scene::Leaves] {
        let starts: Vec<f64> = (0..8).map(|seed| clip(scene, seed).target(0).x).collect();
        let (least, most) = starts
            .iter()
            .fold((f64::MAX, f64::MIN), |(least, most), &x| {
                (least.min(x), most.max(x))
            });
        assert!(most - least > 10.0, "{scene:?}: {starts:?}");
    }
}

#[test]
fn long_and_short_clips_hide_the_target_as_long() {
    for (scene, frames, hidden) in [
        (Scene::Covered, 90, 20),
        (Scene::Covered, 401, 20),
        (Scene::Leaves, 90, 25),
        (Scene::Leaves, 401, 25),
    ] {
        let clip = Clip::new(Settings {
            scene,
            frames,
            ..Settings::default()
        })
        .expect("the settings are in order");
        assert_eq!(
            out_of_sight(&clip).len(),
            hidden,
            "{scene:?}, {frames} frames"
        );
        assert_eq!((clip.visible(0), clip.visible(frames - 1)), (1.0, 1.0));
    }
}

#[test]
fn frames_out_of_sight_are_not_annotated_in_the_folder() {
    let parent = tempfile::tempdir().expect("the system has a place for temporary folders");
    let clip = clip(Scene::Leaves, 1);
    clip.write(parent.path(), Format::Jpeg, || ())
        .expect("the folder is writable");
    let boxes = read_boxes(parent.path()).expect("it was written");
    let visible =
        std::fs::read_to_string(parent.path().join("visible.txt")).expect("it was written");
    let visible: Vec<&str> = visible.lines().collect();
    assert_eq!((boxes.len(), visible.len()), (150, 150));
    for index in 0..clip.frames() {
        let (found, seen) = (boxes[index as usize], visible[index as usize]);
        if clip.visible(index) == 0.0 {
            assert_eq!((found, seen), (None, "0"), "frame {index}");
        } else {
            let found = found.expect("it is seen");
            let card = clip.target(index);
            assert!((found.x - card.x).abs() < 1e-3 && (found.height - card.height).abs() < 1e-3);
            assert_eq!(seen, "1", "frame {index}");
        }
    }
}

/// A short clip with changed attributes.
fn hard(change: impl Fn(&mut Attributes)) -> Clip {
    let mut settings = Settings {
        frames: 40,
        ..Settings::default()
    };
    change(&mut settings.attributes);
    Clip::new(settings).expect("the attributes are in their ranges")
}

/// The sum of the differences between `before`, moved by (right, down) pixels, and `after`.
fn misfit(before: &RgbImage, after: &RgbImage, (right, down): (i64, i64)) -> u64 {
    let (width, height) = before.dimensions();
    let inside =
        |x: i64, y: i64| (0..i64::from(width)).contains(&x) && (0..i64::from(height)).contains(&y);
    let mut sum = 0;
    for (x, y, pixel) in before.enumerate_pixels() {
        let (x, y) = (i64::from(x) + right, i64::from(y) + down);
        if inside(x, y) {
            let moved = after.get_pixel(x as u32, y as u32);
            sum += u64::from(pixel.0[1].abs_diff(moved.0[1]));
        }
    }
    sum
}

#[test]
fn the_true_box_follows_each_attribute() {
    let plain = hard(|_| ());
    let (first, last) = (plain.target(0), plain.target(39));
    let small = hard(|attributes| attributes.low_resolution = 0.2);
    assert!((small.target(0).width - 0.2 * first.width).abs() < 1e-9);
    let fast = hard(|attributes| attributes.fast_motion = 4.0);
    assert!((fast.target(5).center().0 - plain.target(20).center().0).abs() < 1e-9);
    let growing = hard(|attributes| attributes.scale_variation = 3.0);
    assert!((growing.target(0).height - first.height).abs() < 1e-9);
    assert!((growing.target(39).height - 3.0 * last.height).abs() < 1e-9);
    let thin = hard(|attributes| attributes.out_of_plane_rotation = 0.3);
    let aspects = [0, 19, 39].map(|index| thin.target(index).width / thin.target(index).height);
    assert!(aspects[1] < 0.31 * aspects[0] && (aspects[2] - aspects[0]).abs() < 1e-9);
    let turning = hard(|attributes| attributes.in_plane_rotation = 9.0);
    // After ten frames, a quarter turn, width and height are swapped.
    let (upright, lying) = (plain.target(10), turning.target(10));
    assert!(
        (lying.width - upright.height).abs() < 1e-6 && (lying.height - upright.width).abs() < 1e-6
    );
}

#[test]
fn a_shaken_camera_moves_the_wall_and_the_true_box_by_the_same_pixels() {
    let (still, shaken) = (
        hard(|_| ()),
        hard(|attributes| attributes.camera_motion = 0.05),
    );
    let mut moved = 0;
    for index in [3, 17, 31] {
        let (from, to) = (still.target(index), shaken.target(index));
        let offset = (
            (to.x - from.x).round() as i64,
            (to.y - from.y).round() as i64,
        );
        moved += offset.0.abs() + offset.1.abs();
        let (before, after) = (still.draw(index), shaken.draw(index));
        let fits = misfit(&before, &after, offset);
        for wrong in [
            (offset.0 + 1, offset.1),
            (offset.0, offset.1 - 1),
            (-offset.0, offset.1),
        ] {
            if wrong != offset {
                assert!(
                    10 * fits < 9 * misfit(&before, &after, wrong),
                    "frame {index}: {wrong:?}"
                );
            }
        }
    }
    assert!(moved > 0, "it stands still");
}

#[test]
fn a_blurred_card_has_softer_edges_and_a_look_alike_shows_the_same_card_elsewhere() {
    let fast = |blur: f64| {
        hard(|attributes| (attributes.fast_motion, attributes.motion_blur) = (6.0, blur))
    };
    let contrast = |clip: &Clip| {
        let (picture, card) = (clip.draw(9), clip.target(9));
        let (left, top) = (card.x as u32, card.y as u32);
        let (right, bottom) = (left + card.width as u32, top + card.height as u32);
        let mut sum = 0u64;
        for y in top..bottom {
            for x in left..right {
                let next = picture.get_pixel(x + 1, y).0[1];
                sum += u64::from(picture.get_pixel(x, y).0[1].abs_diff(next));
            }
        }
        sum
    };
    assert!(contrast(&fast(1.0)) * 10 < contrast(&fast(0.0)) * 7);
    let (alone, among) = (
        hard(|_| ()),
        hard(|attributes| attributes.similar_objects = 2),
    );
    let card = alone.target(0).area() as usize;
    let more = changed(&alone.draw(0), &among.draw(0));
    assert!(
        more > card && more < 5 * card / 2,
        "{more} pixels of {card}"
    );
    assert_eq!(alone.target(0), among.target(0));
}
