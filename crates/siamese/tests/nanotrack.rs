//! NanoTrack from ONNX files, as the tracker uses it.

use bagtrack_siamese::{ModelError, NanoTrack};
use bagtrack_testing::tiny_network;
use bagtrack_tracker::{Expert, Frame, Rect};

/// A red target on a ground of green and blue, both in stripes.
fn frame(target: &Rect) -> Frame {
    let (width, height) = (320, 240);
    let mut rgb = Vec::new();
    for y in 0..height {
        for x in 0..width {
            let (at_x, at_y) = (f64::from(x) + 0.5 - target.x, f64::from(y) + 0.5 - target.y);
            let inside =
                (0.0..target.width).contains(&at_x) && (0.0..target.height).contains(&at_y);
            let stripe = if (x / 8 + y / 8) % 2 == 0 { 40 } else { 0 };
            rgb.extend(match inside {
                true => [180 + stripe, 30, 30],
                false => [20, 90 + stripe, 60],
            });
        }
    }
    Frame::from_rgb(width, height, &rgb).unwrap()
}

fn tiny() -> NanoTrack {
    NanoTrack::from_onnx(&tiny_network::backbone(), &tiny_network::head()).unwrap()
}

#[test]
fn a_network_of_fixed_weights_follows_a_colour() {
    let network = tiny();
    let target = |t: i32| {
        Rect::new(
            60.0 + 9.0 * f64::from(t),
            50.0 + 5.0 * f64::from(t),
            48.0,
            48.0,
        )
    };
    let template = network.start(&frame(&target(0)), &target(0));
    assert_eq!(template.len(), network.template_len());
    let mut place = target(0);
    for t in 1..20 {
        let seen = network.look(&frame(&target(t)), &template, &place);
        let distance = seen.target.center_distance(&target(t));
        // Places of the head's grid are 16 pixels of the picture apart, some 12 of the frame, and the middle counts
        // most.
        assert!(distance < 18.0, "frame {t}: {distance}");
        assert!(seen.score > 0.7, "frame {t}: {}", seen.score);
        place = seen.target;
    }
    // The target is gone, and the score is low.
    let empty = frame(&Rect::new(-900.0, 0.0, 10.0, 10.0));
    let seen = network.look(&empty, &template, &place);
    assert!(seen.score < 0.3, "{}", seen.score);
}

#[test]
fn gray_frames_and_places_beside_the_frame_are_seen_too() {
    let network = tiny();
    let colored = frame(&Rect::new(100.0, 80.0, 48.0, 48.0));
    let gray = Frame::from_luma(320, 240, colored.pixels().to_vec()).unwrap();
    let target = Rect::new(100.0, 80.0, 48.0, 48.0);
    let template = network.start(&gray, &target);
    for place in [
        target,
        Rect::new(-400.0, 900.0, 30.0, 80.0),
        Rect::new(0.0, 0.0, 4.0, 1200.0),
    ] {
        let seen = network.look(&gray, &template, &place);
        assert!(
            seen.target.is_valid() && (0.0..=1.0).contains(&seen.score),
            "{seen:?}"
        );
    }
}

/// A template comes back in a snapshot, which may hold anything that is finite.
#[test]
fn no_template_makes_a_box_that_is_none() {
    let network = tiny();
    let gray = frame(&Rect::new(100.0, 80.0, 48.0, 48.0));
    for value in [f32::MAX, f32::MIN, 0.0, f32::MIN_POSITIVE] {
        let template = vec![value; network.template_len()];
        let seen = network.look(&gray, &template, &Rect::new(50.0, 50.0, 40.0, 40.0));
        assert!(
            seen.target.is_valid() && (0.0..=1.0).contains(&seen.score),
            "{seen:?}"
        );
    }
}

#[test]
fn what_is_no_such_network_is_refused_with_the_reason() {
    let (backbone, head) = (tiny_network::backbone(), tiny_network::head());
    let refusal = |backbone: &[u8], head: &[u8]| NanoTrack::from_onnx(backbone, head).unwrap_err();
    assert!(matches!(
        refusal(b"not ONNX", &head),
        ModelError::NotOnnx(_)
    ));
    assert!(matches!(refusal(&[], &head), ModelError::NotOnnx(_)));
    // The two files in the wrong order.
    assert!(matches!(
        refusal(&head, &backbone),
        ModelError::Unexpected(_)
    ));
    assert!(matches!(
        refusal(&backbone, &backbone),
        ModelError::Unexpected(_)
    ));
    let unknown = refusal(&tiny_network::of_operation("LSTM"), &head);
    assert!(unknown.to_string().contains("LSTM"), "{unknown}");
    // An unchanged picture has three channels; the head takes four.
    let unfit = refusal(&tiny_network::of_operation("Relu"), &head);
    assert!(matches!(unfit, ModelError::Operation { .. }), "{unfit}");
    for len in 0..backbone.len() {
        if len % 97 == 0 {
            NanoTrack::from_onnx(&backbone[..len], &head).unwrap_err();
        }
    }
}

#[test]
fn the_same_files_have_the_same_fingerprint() {
    let (backbone, mut head) = (tiny_network::backbone(), tiny_network::head());
    assert_eq!(tiny().fingerprint(), tiny().fingerprint());
    // A field that the parser passes over.
    head.extend([8, 7]);
    let other = NanoTrack::from_onnx(&backbone, &head).unwrap();
    assert_ne!(other.fingerprint(), tiny().fingerprint());
}
