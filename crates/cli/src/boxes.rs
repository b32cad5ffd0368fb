//! The annotated boxes of a sequence in the OTB layout.

use super::frames::SequenceError;
use bagtrack_tracker::Rect;
use std::fs;
use std::path::Path;

/// The file of the boxes in the folder of a sequence.
pub const BOXES: &str = "groundtruth_rect.txt";

/// Reads the boxes of the sequence in `dir`.
///
/// # Errors
/// The file is missing, or a line of it is not four numbers.
pub fn read_boxes(dir: &Path) -> Result<Vec<Option<Rect>>, SequenceError> {
    let text = fs::read_to_string(dir.join(BOXES))
        .map_err(|error| SequenceError::new(dir, format!("{BOXES}: {error}")))?;
    parse_boxes(&text).map_err(|reason| SequenceError::new(dir, format!("{BOXES}: {reason}")))
}

/// Reads OTB boxes, `x,y,width,height` a line, separated by commas, tabs or spaces: coordinates are 1-based in the
/// text, 0-based in the result. A box without size (`0,0,0,0`) or with a NaN in it means that the frame is not
/// annotated.
///
/// # Errors
/// A line is not four numbers; the text says which.
pub fn parse_boxes(text: &str) -> Result<Vec<Option<Rect>>, String> {
    text.trim_end()
        .lines()
        .enumerate()
        .map(|(index, line)| {
            let numbers: Option<Vec<f64>> = line
                .split(|c: char| c == ',' || c.is_whitespace())
                .filter(|field| !field.is_empty())
                .map(|field| field.parse().ok())
                .collect();
            match numbers.as_deref() {
                Some(&[x, y, width, height]) => {
                    let annotated = [x, y, width, height].iter().all(|n| n.is_finite())
                        && width > 0.0
                        && height > 0.0;
                    Ok(annotated.then_some(Rect::new(x - 1.0, y - 1.0, width, height)))
                }
                _ => Err(format!(
                    "line {} is not x,y,width,height: {line:?}",
                    index + 1
                )),
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boxes_may_be_separated_by_commas_tabs_or_spaces() {
        let expected = Some(Rect::new(0.0, 1.5, 3.0, 4.0));
        for text in [
            "1,2.5,3,4",
            "1\t2.5\t3\t4",
            "1 2.5 3 4\r\n",
            " 1, 2.5, 3, 4 \n\n",
        ] {
            assert_eq!(parse_boxes(text), Ok(vec![expected]), "{text:?}");
        }
    }

    #[test]
    fn boxes_without_size_are_not_annotations() {
        assert_eq!(
            parse_boxes("0,0,0,0\nNaN,NaN,NaN,NaN\n5,5,10,-1"),
            Ok(vec![None; 3])
        );
    }

    #[test]
    fn a_broken_line_is_named() {
        let error = parse_boxes("1,2,3,4\n1,2,3\n").expect_err("three numbers are no box");
        assert!(error.contains("line 2"), "{error}");
    }
}
