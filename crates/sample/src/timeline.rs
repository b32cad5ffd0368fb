//! What happens in the clip, frame by frame: where the card is, how bright the light is, and what covers the card.

mod course;
mod covered;
mod default;
mod leaves;

use super::pose::Pose;
use super::scene::Scene;
use super::settings::Settings;
use bagtrack_tracker::Rect;
use course::Course;

/// A visible share of the card below this is rounding error, and counts as 0.
const ROUNDING: f64 = 1e-9;

/// The events of a clip.
#[derive(Debug)]
pub(super) struct Timeline {
    course: Course,
}

impl Timeline {
    pub(super) fn new(settings: Settings) -> Self {
        Self {
            course: Course::new(settings),
        }
    }

    /// The upright box around the card.
    pub(super) fn target(&self, index: u32) -> Rect {
        self.card(index).bounds()
    }

    /// How the card lies.
    pub(super) fn card(&self, index: u32) -> Pose {
        let area = match self.course.settings.scene {
            Scene::Default => default::target(&self.course, index),
            Scene::Covered => self.course.mirrored(covered::target(&self.course, index)),
            Scene::Leaves => self.course.mirrored(leaves::target(&self.course, index)),
        };
        self.posed(area, index)
    }

    /// How the cards lie that look like the target.
    pub(super) fn similar(&self, index: u32) -> impl Iterator<Item = Pose> {
        let others = 1..=self.course.settings.attributes.similar_objects;
        others.map(move |number| self.posed(default::on_path(&self.course, index, number), index))
    }

    /// The pose of a card at `area` of the scene, turned, and moved as the camera moves the picture.
    fn posed(&self, area: Rect, index: u32) -> Pose {
        let degrees = self.course.settings.attributes.in_plane_rotation * f64::from(index);
        Pose {
            angle: degrees.to_radians(),
            ..Pose::of(self.seen(area, index))
        }
    }

    /// How far the camera has moved the picture, in whole pixels to the right and down.
    pub(super) fn camera(&self, index: u32) -> (i32, i32) {
        self.course.camera(index)
    }

    fn seen(&self, area: Rect, index: u32) -> Rect {
        let (right, down) = self.camera(index);
        Rect {
            x: area.x + f64::from(right),
            y: area.y + f64::from(down),
            ..area
        }
    }

    /// Factor on all light.
    pub(super) fn light(&self, index: u32) -> f64 {
        match self.course.settings.scene {
            Scene::Default => default::light(&self.course, index),
            Scene::Covered | Scene::Leaves => 1.0,
        }
    }

    /// What stands before the card.
    pub(super) fn board(&self, index: u32) -> Option<Rect> {
        let board = match self.course.settings.scene {
            Scene::Default => default::board(&self.course, index),
            Scene::Covered => Some(self.course.mirrored(covered::post(&self.course))),
            Scene::Leaves => None,
        };
        Some(self.seen(board?, index))
    }

    /// The share of the card that the board covers.
    pub(super) fn covered(&self, index: u32) -> f64 {
        match self.course.settings.scene {
            Scene::Default => default::covered(&self.course, index),
            Scene::Covered | Scene::Leaves => {
                let card = self.target(index);
                let covered = |board: Rect| card.intersection(&board).area() / card.area();
                self.board(index).map_or(0.0, covered)
            }
        }
    }

    /// The share of the card that is in the frame and not covered.
    pub(super) fn visible(&self, index: u32) -> f64 {
        let card = self.target(index);
        let (width, height) = self.course.size();
        let inside = card.intersection(&Rect::new(0.0, 0.0, width, height));
        let inside = inside.area() / card.area();
        let visible = inside - self.covered(index);
        // Rounding leaves a little where there is nothing, and takes a little where there is all.
        match visible {
            ..ROUNDING => 0.0,
            visible if visible > 1.0 - ROUNDING => 1.0,
            visible => visible,
        }
    }
}
