//! Frames with the tracker's answers drawn on them, for people to look at.
//!
//! In: an uploaded file, decoded as strictly as for tracking, and the answers to it. Out: a PNG or JPEG file. The box
//! is green while tracking, orange while uncertain, red when lost, with the score beside it; particles are dots, which
//! are the more opaque the greater their weight.
//!
//! Also the bag of a tracker: the mean and the basis of each affine subspace as small pictures.
//!
//! What can go wrong: the file cannot be decoded. A large frame is drawn smaller, since a picture takes three bytes a
//! pixel, and its file may take as many.

mod bag;
mod label;
mod marks;
mod picture;

pub use bag::ContactSheet;
pub use marks::{Drawn, draw};
pub use picture::Picture;
