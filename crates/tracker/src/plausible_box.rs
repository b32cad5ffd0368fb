//! Boxes that are likely a mistake: in other units or by other corners. What cannot be meant is refused with a guess; a
//! box that reaches far outside the frame is tracked, with a warning.

use crate::image::rect::Rect;
use crate::input::MIN_BOX_SIDE;

/// A box with more than this share of its area outside is warned of.
const MAX_OUTSIDE: f64 = 0.5;
/// The same, for a box whose numbers may well be two corners.
const MAX_OUTSIDE_AS_CORNERS: f64 = 0.01;

/// Width and height of a frame in pixels.
type Size = (u32, u32);

/// Why a box cannot be meant, with the box that may be.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ImplausibleBox {
    /// A side is negative.
    #[error(
        "the box has a negative {side}: a box is x,y,width,height, and x,y is its top left corner"
    )]
    Negative {
        /// `width` or `height`.
        side: &'static str,
    },
    /// The box is in fractions of the frame.
    #[error(
        "the box looks like fractions of the frame; give pixels: in this frame of {} x {} that is `box={pixels}`",
        size.0,
        size.1
    )]
    Fractions {
        /// The frame's width and height.
        size: (u32, u32),
        /// The box in pixels.
        pixels: String,
    },
    /// The box is two corners.
    #[error(
        "the box lies by {percent} % outside the frame of {} x {}, and looks like x1,y1,x2,y2; give x,y,width,height: \
         `box={pixels}`",
        size.0,
        size.1
    )]
    Corners {
        /// The share of the box that lies outside the frame, in percent.
        percent: f64,
        /// The frame's width and height.
        size: (u32, u32),
        /// The box between the corners.
        pixels: String,
    },
}

/// Refuses a box that cannot be meant in a frame of this size.
///
/// # Errors
/// A side is negative, the box is in fractions of the frame, or it is two corners and most of it lies outside.
pub fn check_box(target: &Rect, size: Size) -> Result<(), ImplausibleBox> {
    let (width, height) = (f64::from(size.0), f64::from(size.1));
    if target.width < 0.0 || target.height < 0.0 {
        let side = if target.width < 0.0 {
            "width"
        } else {
            "height"
        };
        return Err(ImplausibleBox::Negative { side });
    }
    let sides = [target.width, target.height];
    let all = [target.x, target.y, target.width, target.height];
    if all.iter().all(|n| (0.0..=1.0).contains(n)) && sides.iter().all(|side| *side > 0.0) {
        let pixels = shown(
            target.x * width,
            target.y * height,
            target.width * width,
            target.height * height,
        );
        return Err(ImplausibleBox::Fractions { size, pixels });
    }
    match (outside(target, size), as_corners(target, size)) {
        (share, Some(pixels)) if share > MAX_OUTSIDE => Err(ImplausibleBox::Corners {
            percent: percent(share),
            size,
            pixels,
        }),
        _ => Ok(()),
    }
}

/// The warnings of the boxes of a frame of this size, where there are any.
pub fn box_warnings(boxes: &[Rect], size: Size) -> Option<Vec<String>> {
    let warnings = boxes.iter().enumerate().filter_map(|(target, of)| {
        let warning = warning(of, size)?;
        Some(match boxes.len() {
            1 => warning,
            count => format!("Target {target} of {count}, counted from 0: {warning}"),
        })
    });
    let warnings: Vec<_> = warnings.collect();
    (!warnings.is_empty()).then_some(warnings)
}

fn warning(target: &Rect, size: Size) -> Option<String> {
    let share = outside(target, size);
    let corners = as_corners(target, size);
    let most = match corners {
        Some(_) => MAX_OUTSIDE_AS_CORNERS,
        None => MAX_OUTSIDE,
    };
    let guess = corners.map_or(String::new(), |corners| {
        format!(" If it is x1,y1,x2,y2, give x,y,width,height: `box={corners}`.")
    });
    (share > most).then(|| {
        let percent = percent(share);
        format!("{percent} % of the box lies outside the frame.{guess}")
    })
}

/// The share of the box's area that lies outside the frame.
fn outside(target: &Rect, (width, height): Size) -> f64 {
    let across = (target.x + target.width).min(width.into()) - target.x.max(0.0);
    let down = (target.y + target.height).min(height.into()) - target.y.max(0.0);
    let area = target.width * target.height;
    match area > 0.0 {
        true => 1.0 - across.max(0.0) * down.max(0.0) / area,
        false => 0.0,
    }
}

/// The box that is meant where the numbers are two corners, if these are a box in the frame.
fn as_corners(target: &Rect, (width, height): Size) -> Option<String> {
    let (x, y, right, bottom) = (target.x, target.y, target.width, target.height);
    let is_box = x >= 0.0
        && y >= 0.0
        && right - x >= MIN_BOX_SIDE
        && bottom - y >= MIN_BOX_SIDE
        && right <= width.into()
        && bottom <= height.into();
    is_box.then(|| shown(x, y, right - x, bottom - y))
}

/// The four numbers, rounded to a tenth of a pixel, with commas between.
fn shown(x: f64, y: f64, width: f64, height: f64) -> String {
    [x, y, width, height]
        .map(|n| ((n * 10.0).round() / 10.0).to_string())
        .join(",")
}

fn percent(share: f64) -> f64 {
    (100.0 * share).round()
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: Size = (640, 480);

    fn rect([x, y, width, height]: [f64; 4]) -> Rect {
        Rect::new(x, y, width, height)
    }

    #[test]
    fn a_likely_mistake_is_refused_with_the_box_that_is_meant() {
        for (sides, guess) in [
            ([500.0, 400.0, 600.0, 470.0], "`box=500,400,100,70`"),
            ([0.46, 0.33, 0.07, 0.16], "`box=294.4,158.4,44.8,76.8`"),
            ([0.0, 0.0, 1.0, 1.0], "`box=0,0,640,480`"),
            ([50.0, 50.0, -20.0, 30.0], "negative width"),
            ([50.0, 50.0, 20.0, -30.0], "negative height"),
        ] {
            let error = check_box(&rect(sides), SIZE).unwrap_err().to_string();
            assert!(error.contains(guess), "{error}");
        }
    }

    #[test]
    fn a_box_that_may_be_meant_is_taken_and_one_far_outside_warned_of() {
        for (sides, warned) in [
            ([20.0, 15.0, 16.0, 12.0], None),
            // The target enters the frame.
            ([630.0, 100.0, 40.0, 60.0], Some("75 %")),
            ([-30.0, 100.0, 40.0, 60.0], Some("75 %")),
            ([620.0, 100.0, 25.0, 60.0], None),
            // Two corners, but as a box the numbers hardly leave the frame.
            ([298.0, 160.0, 346.0, 240.0], Some("`box=298,160,48,80`")),
            ([0.0, 0.0, 640.0, 480.0], None),
        ] {
            assert!(check_box(&rect(sides), SIZE).is_ok(), "{sides:?}");
            let warnings = box_warnings(&[rect(sides)], SIZE);
            match warned {
                None => assert_eq!(warnings, None, "{sides:?}"),
                Some(text) => assert!(warnings.unwrap()[0].contains(text), "{sides:?}"),
            }
        }
        let two = [rect([0.0, 0.0, 9.0, 9.0]), rect([-8.0, 0.0, 9.0, 9.0])];
        assert!(box_warnings(&two, SIZE).unwrap()[0].starts_with("Target 1 of 2"));
    }

    #[test]
    fn each_bound_of_a_likely_mistake_holds_by_itself() {
        let told = |sides| check_box(&rect(sides), SIZE).map_err(|error| error.to_string());
        // A side of 0 is refused by the tracker, not here.
        for sides in [[50.0, 50.0, 0.0, 30.0], [50.0, 50.0, 30.0, 0.0]] {
            assert_eq!(told(sides), Ok(()), "{sides:?}");
        }
        let negative = told([50.0, 50.0, 0.0, -30.0]).unwrap_err();
        assert!(negative.contains("negative height"), "{negative}");
        // One number is too large for a fraction, or a side is 0.
        for sides in [
            [0.0, 0.0, 1.0, 2.0],
            [0.0, 0.0, 0.0, 1.0],
            [0.0, 0.0, 1.0, 0.0],
        ] {
            assert_eq!(told(sides), Ok(()), "{sides:?}");
        }
        // Half of the box is in the frame, so it is not refused, even where its numbers may be corners.
        assert_eq!(told([320.0, 0.0, 640.0, 480.0]), Ok(()));
        assert_eq!(
            box_warnings(&[rect([-20.0, 100.0, 40.0, 60.0])], SIZE),
            None
        );
        // Corners must be four pixels apart along x and along y.
        let corners = told([600.0, 460.0, 604.0, 464.0]).unwrap_err();
        assert!(corners.contains("box=600,460,4,4"), "{corners}");
        for sides in [[600.0, 460.0, 603.9, 464.0], [600.0, 460.0, 604.0, 463.9]] {
            assert_eq!(told(sides), Ok(()), "{sides:?}");
        }
    }

    #[test]
    fn corners_that_lie_in_the_frame_are_guessed_and_no_others() {
        let guess = |sides| {
            let warnings = box_warnings(&[rect(sides)], SIZE)?;
            let (_, guess) = warnings[0].split_once("`box=")?;
            Some(guess.trim_end_matches("`.").to_owned())
        };
        let of_all = guess([100.0, 100.0, 640.0, 480.0]);
        assert_eq!(of_all.as_deref(), Some("100,100,540,380"));
        let at_the_corner = guess([0.0, 0.0, 640.0, 490.0]);
        assert_eq!(at_the_corner, None);
        let rounded = guess([100.04, 100.06, 600.0, 470.0]);
        assert_eq!(rounded.as_deref(), Some("100,100.1,500,369.9"));
        for sides in [
            [100.0, 100.0, 641.0, 480.0],
            [100.0, 100.0, 640.0, 481.0],
            [-10.0, 100.0, 300.0, 400.0],
            [100.0, -10.0, 300.0, 300.0],
            [500.0, 100.0, 503.0, 300.0],
            [100.0, 400.0, 300.0, 403.0],
        ] {
            assert_eq!(guess(sides), None, "{sides:?}");
        }
        // The share is rounded to whole percents, here from 2.1 %.
        let warned = box_warnings(&[rect([100.0, 100.0, 546.0, 384.0])], SIZE).unwrap();
        assert!(warned[0].starts_with("2 %"), "{warned:?}");
    }
}
