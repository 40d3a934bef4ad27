//! A table of outcomes as colours, with a short word in each cell.

use super::ChartError;
use super::file::Picture;
use super::grid::AIR;
use super::palette::{Colour, EXCLUDED, FAILED, GREEN, GREY, GRID, INK, SPINE, VERMILLION, WHITE, mix};
use super::sheet::{CAPTION, EDGE, NOTE, Pen, Sheet, note};
use super::text::{Align, Lettering, TextLevel};
use std::f64::consts::FRAC_PI_2;

/// Width, at least, and height of a cell, the em of its word, and the air beside that \[pt\].
const CELL: [f64; 2] = [31.0, 11.5];
const BESIDE: f64 = 3.0;
const WORD: f64 = 7.0;
/// Side of a square of the legend \[pt\].
const SWATCH: f64 = 8.0;
/// Words beside and above the cells begin so far away \[pt\].
const GAP: f64 = 5.0;

/// What a cell shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CellOutcome {
    /// Right.
    Right,
    /// Refused.
    #[default]
    Refused,
    /// Stopped.
    Stopped,
    /// Wrong.
    Wrong,
}

/// A table of outcomes.
#[derive(Clone, Debug, Default)]
pub struct OutcomeMatrix {
    /// Title, with markup.
    pub title: String,
    /// Parts of the caption, with markup.
    pub caption: Vec<String>,
    /// Names of the rows from the top, and of the columns from the left, with markup.
    pub rows: Vec<String>,
    /// See `rows`.
    pub columns: Vec<String>,
    /// Row by row, the outcome and a short word.
    pub cells: Vec<(CellOutcome, String)>,
}

impl CellOutcome {
    const ALL: [Self; 4] = [Self::Right, Self::Refused, Self::Stopped, Self::Wrong];

    fn colour(self) -> Colour {
        match self {
            Self::Right => mix(GREEN, WHITE, 0.62),
            Self::Refused => EXCLUDED,
            Self::Stopped => FAILED,
            Self::Wrong => VERMILLION,
        }
    }

    fn word(self) -> &'static str {
        match self {
            Self::Right => "right, with its error",
            Self::Refused => "refused",
            Self::Stopped => "stopped",
            Self::Wrong => "wrong",
        }
    }
}

/// Draws the table, and how many of each outcome there are.
///
/// # Errors
/// [`ChartError`] if the resolution is out of range or drawing fails.
pub fn matrix(chart: &OutcomeMatrix, px_per_pt: f64) -> Result<Picture, ChartError> {
    let trial = Sheet::new([CELL[0], CELL[1]], px_per_pt)?;
    let widest =
        |names: &[String]| names.iter().map(|name| trial.width(name, NOTE, false)).fold(0.0, f64::max);
    let left = EDGE + widest(&chart.rows) + GAP;
    let words = chart.cells.iter().map(|(_, word)| trial.width(word, WORD, false) + 2.0 * BESIDE);
    let cell = [words.fold(CELL[0], f64::max), CELL[1]];
    let size = [chart.columns.len() as f64 * cell[0], chart.rows.len() as f64 * cell[1]];
    let legend = legend(chart);
    let told: f64 = legend.iter().map(|(_, words)| SWATCH + 18.0 + trial.width(words, NOTE, false)).sum();
    let width = (left + size[0]).max(2.0 * EDGE + told).max(240.0) + EDGE;
    let under = Sheet::new([width, width], px_per_pt)?.heading(&chart.title, &chart.caption)?;
    let top = under + 16.0 + AIR + widest(&chart.columns) + GAP;
    let sheet = Sheet::new([width, top + size[1] + EDGE], px_per_pt)?;
    sheet.heading(&chart.title, &chart.caption)?;
    let mut at = EDGE;
    for (colour, words) in &legend {
        sheet.polygon(&square([at, under + AIR - 4.0], [SWATCH; 2]), SPINE)?;
        sheet.polygon(&square([at + 0.5, under + AIR - 3.5], [SWATCH - 1.0; 2]), *colour)?;
        sheet.words(
            words,
            note(GREY, Align::Left, TextLevel::Middle),
            [at + SWATCH + 4.0, under + AIR - 4.0 + 0.5 * SWATCH],
        )?;
        at += SWATCH + 18.0 + sheet.width(words, NOTE, false);
    }
    for (k, name) in chart.columns.iter().enumerate() {
        let upright = Lettering { angle: FRAC_PI_2, ..note(INK, Align::Left, TextLevel::Middle) };
        sheet.words(name, upright, [left + (k as f64 + 0.5) * cell[0], top - GAP])?;
    }
    for (i, name) in chart.rows.iter().enumerate() {
        let y = top + i as f64 * cell[1];
        sheet.words(name, note(INK, Align::Right, TextLevel::Middle), [left - GAP, y + 0.5 * cell[1]])?;
        for k in 0..chart.columns.len() {
            let Some((outcome, word)) = chart.cells.get(i * chart.columns.len() + k) else { continue };
            let x = left + k as f64 * cell[0];
            sheet.polygon(&square([x, y], cell), outcome.colour())?;
            let ink = if *outcome == CellOutcome::Wrong { WHITE } else { INK };
            let lettering = Lettering::new(WORD, ink).at(Align::Centre, TextLevel::Middle);
            sheet.words(word, lettering, [x + 0.5 * cell[0], y + 0.5 * cell[1]])?;
        }
    }
    let pen = Pen::new(GRID, 0.6);
    for k in 0..=chart.columns.len() {
        let x = left + k as f64 * cell[0];
        sheet.line(&[[x, top], [x, top + size[1]]], &pen)?;
    }
    for i in 0..=chart.rows.len() {
        let y = top + i as f64 * cell[1];
        sheet.line(&[[left, y], [left + size[0], y]], &pen)?;
    }
    if chart.rows.is_empty() || chart.columns.is_empty() {
        sheet.words("no data", Lettering::new(CAPTION, GREY), [left, top])?;
    }
    Ok(sheet.picture(&chart.title, &chart.caption))
}

/// The outcomes, in colours and words: `423 right, with its error`.
fn legend(chart: &OutcomeMatrix) -> Vec<(Colour, String)> {
    let count = |outcome: CellOutcome| chart.cells.iter().filter(|cell| cell.0 == outcome).count();
    CellOutcome::ALL
        .iter()
        .map(|&outcome| (outcome.colour(), format!("{} {}", count(outcome), outcome.word())))
        .collect()
}

fn square([x, y]: [f64; 2], [width, height]: [f64; 2]) -> [[f64; 2]; 4] {
    [[x, y], [x + width, y], [x + width, y + height], [x, y + height]]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_cell_and_every_name_is_there() {
        let cells = vec![
            (CellOutcome::Right, "1e-9".into()),
            (CellOutcome::Wrong, "2e-3".into()),
            (CellOutcome::Stopped, String::new()),
        ];
        let chart = OutcomeMatrix {
            rows: vec!["spring".into()],
            columns: ["a", "b", "c"].map(Into::into).into(),
            cells,
            ..OutcomeMatrix::default()
        };
        let picture = matrix(&chart, 2.0).expect("a picture");
        for words in ["spring", "a", "b", "c", "1e-9", "2e-3", "1 wrong", "0 refused"] {
            assert!(picture.texts.iter().any(|text| text.text == words), "{words}");
        }
    }

    #[test]
    fn outcomes_stay_apart_when_colours_are_few() {
        let apart = |a: Colour, b: Colour| {
            let parts = [(a.0, b.0), (a.1, b.1), (a.2, b.2)];
            parts.iter().map(|&(a, b)| (f64::from(a) - f64::from(b)).powi(2)).sum::<f64>().sqrt()
        };
        for (k, a) in CellOutcome::ALL.iter().enumerate() {
            for b in &CellOutcome::ALL[..k] {
                // A palette of 16 colours takes together what is nearer than about 40.
                assert!(apart(a.colour(), b.colour()) > 50.0, "{a:?} and {b:?}");
            }
        }
    }

    #[test]
    fn cells_are_wider_than_their_words() {
        let words = ["refused", "9.9e-16", "a longer word"];
        let chart = OutcomeMatrix {
            rows: vec!["scene".into()],
            columns: words.map(String::from).to_vec(),
            cells: words.map(|word| (CellOutcome::Right, word.into())).to_vec(),
            ..OutcomeMatrix::default()
        };
        let texts = matrix(&chart, 1.0).expect("a picture").texts;
        let ends: Vec<[f64; 2]> = (texts.iter().rev())
            .filter(|text| words.contains(&&*text.text))
            .take(3)
            .map(|text| text.bounds())
            .map(|[left, _, right, _]| [left, right])
            .collect();
        assert!(ends.windows(2).all(|pair| pair[1][1] + 2.0 * BESIDE <= pair[0][0] + 1e-9), "{ends:?}");
    }

    #[test]
    fn an_empty_table_is_a_picture() {
        assert!(matrix(&OutcomeMatrix::default(), 1.0).is_ok());
    }
}
