//! The score's fit as text.

use super::score_report::{Quality, ScoreReport};
use super::table::{Table, figure};
use bagtrack_tracker::{PREDICTORS, ScoreModel};
use std::fmt;

impl ScoreReport {
    /// The tables and the lines below them as markdown.
    pub fn markdown(&self) -> String {
        let [models, sequences] = self.tables();
        let lines = self.lines().replace('\n', "\n\n");
        format!(
            "{}\n{}\n{}\n",
            models.markdown(),
            sequences.markdown(),
            lines.trim_end()
        )
    }

    /// The models, and the sequences one by one.
    fn tables(&self) -> [Table; 2] {
        let mut header = vec!["score", "intercept"];
        header.extend(self.predictors);
        header.extend(["roc auc", "calibration error"]);
        let mut models = Table::new(&header);
        let cells = |model: Option<&ScoreModel>, quality: Option<&Quality>| {
            let mut cells = vec![figure(model.map(|model| model.intercept), 2)];
            cells
                .extend((0..PREDICTORS.len()).map(|i| figure(model.map(|m| m.coefficients[i]), 2)));
            cells.push(figure(quality.and_then(|quality| quality.roc_auc), 3));
            cells.push(figure(quality.and_then(|quality| quality.ece), 3));
            cells
        };
        let mut push = |name: &str, model: Option<&ScoreModel>, quality: Option<&Quality>| {
            models.push([vec![name.to_owned()], cells(model, quality)].concat());
        };
        push(
            "the tracker's",
            Some(&self.tracker.model),
            Some(&self.tracker.quality),
        );
        push(
            "fitted",
            Some(&self.fitted.model),
            Some(&self.fitted.quality),
        );
        push("fitted to the others", None, self.leaving_one_out.as_ref());
        let mut header = vec![
            "sequence left out",
            "frames",
            "hits",
            "tracker's auc",
            "its error",
            "intercept",
        ];
        header.extend(self.predictors);
        header.extend(["roc auc", "calibration error"]);
        let mut sequences = Table::new(&header);
        for sequence in &self.sequences {
            let mut row = vec![
                sequence.name.clone(),
                sequence.frames.to_string(),
                sequence.hits.to_string(),
            ];
            row.extend([
                figure(sequence.tracker.roc_auc, 3),
                figure(sequence.tracker.ece, 3),
            ]);
            let fitted = sequence.fitted.as_ref();
            row.extend(cells(
                fitted.map(|row| &row.model),
                fitted.map(|row| &row.quality),
            ));
            sequences.push(row);
        }
        [models, sequences]
    }

    fn lines(&self) -> String {
        let playback = self.playback.map(|playback| format!("{playback}\n"));
        format!(
            "{}score against overlap >= 0.5: {} frames, {} of them hits; fitted to the {} with the target not lost\n",
            playback.unwrap_or_default(),
            self.frames,
            self.hits,
            self.frames - self.lost,
        )
    }
}

impl fmt::Display for ScoreReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [models, sequences] = self.tables();
        write!(
            f,
            "{}\n{}\n{}",
            models.text(),
            sequences.text(),
            self.lines()
        )
    }
}
