//! The clip as a folder in the OTB layout.

use super::clip::Clip;
use super::error::SampleError;
use super::format::Format;
use std::fs;
use std::path::Path;

impl Clip {
    /// Writes the clip into `dir` in the OTB layout: `img/0001.jpg` (or `.png`) and so on, and
    /// `groundtruth_rect.txt` with `x,y,width,height` a line, in 1-based pixels: the whole card, and `0,0,0,0` (which
    /// is not scored) while nothing of it is seen. `visible.txt` has 1 or 0 a line: whether any of it is seen. Files
    /// of these names are written over. Calls `progress` after each frame.
    ///
    /// # Errors
    /// [`SampleError::Write`].
    pub fn write(
        &self,
        dir: &Path,
        format: Format,
        mut progress: impl FnMut(),
    ) -> Result<(), SampleError> {
        let failed = |path: &Path, reason: String| SampleError::Write {
            path: path.to_owned(),
            reason,
        };
        let pictures = dir.join("img");
        fs::create_dir_all(&pictures).map_err(|error| failed(&pictures, error.to_string()))?;
        let (mut truth, mut seen) = (String::new(), String::new());
        for index in 0..self.frames() {
            let path = pictures.join(format!("{:04}.{}", index + 1, format.extension()));
            let bytes = format
                .encode(&self.draw(index))
                .map_err(|error| failed(&path, error.to_string()))?;
            fs::write(&path, bytes).map_err(|error| failed(&path, error.to_string()))?;
            let card = self.target(index);
            if self.visible(index) > 0.0 {
                truth += &format!(
                    "{:.3},{:.3},{:.3},{:.3}\n",
                    card.x + 1.0,
                    card.y + 1.0,
                    card.width,
                    card.height
                );
                seen += "1\n";
            } else {
                truth += "0,0,0,0\n";
                seen += "0\n";
            }
            progress();
        }
        for (name, text) in [("groundtruth_rect.txt", truth), ("visible.txt", seen)] {
            let path = dir.join(name);
            fs::write(&path, text).map_err(|error| failed(&path, error.to_string()))?;
        }
        Ok(())
    }
}
