//! Isotonic regression: the non-decreasing function of the score that fits yes-or-no outcomes best in least squares,
//! found by pooling adjacent violators (Ayer et al. 1955; used for calibration by Zadrozny and Elkan 2002).

use super::run::Outcome;

/// A run of scores that share one rate of hits.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Block {
    lowest: f64,
    highest: f64,
    hits: f64,
    count: f64,
}

impl Block {
    fn rate(&self) -> f64 {
        self.hits / self.count
    }
}

/// The fit: a chance of a hit for every score.
#[derive(Debug, Clone, PartialEq)]
pub struct Isotonic {
    /// The blocks by rising score, with strictly rising rates; never empty.
    blocks: Vec<Block>,
}

impl Isotonic {
    /// Fits the outcomes; None where there are none. Equal scores are pooled before anything else, so the order of
    /// the outcomes does not count.
    pub fn fit(outcomes: &[Outcome]) -> Option<Self> {
        let mut sorted = outcomes.to_vec();
        sorted.sort_by(|a, b| a.score.total_cmp(&b.score));
        let mut blocks: Vec<Block> = Vec::new();
        let ties = sorted.chunk_by(|a, b| a.score == b.score);
        for tied in ties {
            let mut block = Block {
                lowest: tied[0].score,
                highest: tied[0].score,
                hits: tied.iter().filter(|outcome| outcome.hit).count() as f64,
                count: tied.len() as f64,
            };
            // A block whose rate is not above that of the block before it is pooled with that block.
            while let Some(before) = blocks.pop_if(|before| before.rate() >= block.rate()) {
                block.lowest = before.lowest;
                block.hits += before.hits;
                block.count += before.count;
            }
            blocks.push(block);
        }
        (!blocks.is_empty()).then_some(Self { blocks })
    }

    /// The chance of a hit at `score`, 0 to 1: a block's rate within it, a straight line from one block to the next,
    /// and the outermost rates beyond.
    pub fn chance(&self, score: f64) -> f64 {
        let next = self.blocks.partition_point(|block| block.highest < score);
        let Some(after) = self.blocks.get(next) else {
            return self.blocks[next - 1].rate();
        };
        if score >= after.lowest || next == 0 {
            return after.rate();
        }
        let before = self.blocks[next - 1];
        let share = (score - before.highest) / (after.lowest - before.highest);
        before.rate() + (after.rate() - before.rate()) * share
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// Scores, with whether each was a hit.
    pub(crate) fn outcomes(pairs: &[(f64, u8)]) -> Vec<Outcome> {
        pairs
            .iter()
            .map(|&(score, hit)| Outcome {
                score,
                hit: hit == 1,
            })
            .collect()
    }

    #[test]
    fn violators_are_pooled_as_by_hand() {
        // 0 | 1 0 pooled to 1/2 | 1 0 1 1: 1 stands alone until the 0 comes, (1, 0) pool to 1/2 and with the block
        // of 1/2 before to 2/4; the last two are 1.
        let fit = Isotonic::fit(&outcomes(&[
            (0.1, 0),
            (0.2, 1),
            (0.3, 0),
            (0.4, 1),
            (0.5, 0),
            (0.6, 1),
            (0.7, 1),
        ]))
        .expect("there are outcomes");
        for (score, chance) in [
            (0.0, 0.0),
            (0.1, 0.0),
            (0.15, 0.25),
            (0.2, 0.5),
            (0.33, 0.5),
            (0.5, 0.5),
            (0.55, 0.75),
            (0.6, 1.0),
            (0.9, 1.0),
        ] {
            assert!(
                (fit.chance(score) - chance).abs() < 1e-12,
                "{score}: {} for {chance}",
                fit.chance(score)
            );
        }
    }

    #[test]
    fn a_score_that_falls_with_the_hits_says_nothing() {
        let fit = Isotonic::fit(&outcomes(&[(0.1, 1), (0.5, 1), (0.9, 0), (0.95, 0)]))
            .expect("there are outcomes");
        assert_eq!((fit.chance(0.0), fit.chance(0.7)), (0.5, 0.5));
    }

    #[test]
    fn equal_scores_are_one_point_in_any_order() {
        let one = Isotonic::fit(&outcomes(&[(0.5, 0), (0.5, 1), (0.5, 1), (0.5, 1)]));
        let other = Isotonic::fit(&outcomes(&[(0.5, 1), (0.5, 1), (0.5, 0), (0.5, 1)]));
        assert_eq!(one, other);
        assert_eq!(one.expect("there are outcomes").chance(0.5), 0.75);
        assert_eq!(Isotonic::fit(&[]), None);
    }
}
