//! A value over a rectangle of two others, as colours: nearest cell, no smoothing, a bar that tells the
//! colours' values.

mod scales;

use super::ChartError;
use super::axis::{Axis, Scale};
use super::file::Picture;
use super::grid::AIR;
use super::palette::{Colour, EXCLUDED, FAILED, GREY, INK, SPINE, WHITE, even};
use super::panel::{Panel, WrittenParts, left_room, most_up};
use super::sheet::{EDGE, NAME, NOTE, Pen, Sheet, TICK, note};
use super::text::{Align, Lettering, TextLevel};
use super::ticks::{Tick, Ticks};
use std::f64::consts::FRAC_PI_2;

/// Side of the map, at most \[pt\].
const SIDE: f64 = 256.0;
/// Width of the page at least, for the words of its heading \[pt\].
const WIDTH: f64 = 400.0;
/// Below the map: tick labels and the name of the axis \[pt\].
const BOTTOM: f64 = 44.0;
/// From the map to its bar of colours, and the width of that \[pt\].
const BAR: [f64; 2] = [18.0, 11.0];
/// Colours told apart; more make larger files and show nothing.
const LEVELS: f64 = 48.0;
/// From the bar to the labels of its ticks \[pt\].
const GAP: f64 = 7.5;
/// Side of a square of the legend \[pt\].
const SWATCH: f64 = 8.0;

/// Values below the lower quartile count where they are within this power of the quartiles' ratio, which is
/// taken to be at least `MIDDLE`.
const FENCE: f64 = 1.5;
/// See [`FENCE`].
const MIDDLE: f64 = 10.0;

/// What a map shows in one place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Cell {
    /// A value; one that is not a number counts as failed.
    Value(f64),
    /// What was looked for did not happen.
    Never,
    /// Left out.
    Excluded,
    /// No value came of it.
    Failed,
}

/// An axis of a map: values at equal distances, or by equal factors, each in the middle of its cells.
#[derive(Clone, Debug, Default)]
pub struct MapAxis {
    /// Name with its unit in brackets, with markup.
    pub name: String,
    /// First value.
    pub from: f64,
    /// Last value.
    pub to: f64,
    /// Number of values.
    pub count: usize,
    /// By equal factors.
    pub log: bool,
}

/// A map.
#[derive(Clone, Debug, Default)]
pub struct Map {
    /// Title, with markup.
    pub title: String,
    /// Parts of the caption, with markup.
    pub caption: Vec<String>,
    /// From left to right.
    pub x: MapAxis,
    /// From bottom to top.
    pub y: MapAxis,
    /// The cells, column by column from the left, each from the bottom; missing ones count as failed.
    pub cells: Vec<Cell>,
    /// Name of the value with its unit in brackets, with markup.
    pub value: String,
    /// Colours by the logarithm of the value.
    pub log: bool,
    /// Dark colours for large values instead of small ones.
    pub dark_high: bool,
    /// Ends of the colours; `None`: those of the values, of which a logarithm leaves out the smallest
    /// hundredth and what lies decades below the rest.
    pub range: Option<[f64; 2]>,
    /// What [`Cell::Never`], [`Cell::Excluded`] and [`Cell::Failed`] mean, with markup.
    pub words: [String; 3],
}

/// Draws the map, a legend of the cells without a value, and the bar of colours.
///
/// Values beyond the ends of the colours have the last colour, and the bar says `≤` or `≥` there.
///
/// # Errors
/// [`ChartError`] if the resolution is out of range or drawing fails.
pub fn map(chart: &Map, px_per_pt: f64) -> Result<Picture, ChartError> {
    let (x, y, colours) = (chart.x.drawn(), chart.y.drawn(), Colours::of(chart));
    let legend = legend(chart);
    let side = |count: usize| {
        let most = (SIDE * px_per_pt).max(1.0);
        let whole = (most / count.max(1) as f64).floor() * count as f64;
        // Cells of a whole number of pixels, unless that wastes the page.
        if whole >= 0.8 * most { whole } else { most.floor() }
    };
    let size = [side(chart.x.count), side(chart.y.count)];
    let [width, height] = size.map(|pixels| pixels / px_per_pt);
    let snap = |points: f64| (points * px_per_pt).round() / px_per_pt;
    let trial = Sheet::new([WIDTH, WIDTH], px_per_pt)?;
    let left = snap(EDGE + left_room(&trial, &y, height));
    let right = BAR[0] + BAR[1] + colours.room(&trial, height) + EDGE;
    let page = (left + width + right).max(WIDTH);
    let trial = Sheet::new([page, WIDTH], px_per_pt)?;
    let under = trial.heading(&chart.title, &chart.caption)? + if legend.is_empty() { 0.0 } else { 16.0 };
    let top = snap(under + AIR);

    let sheet = Sheet::new([page, top + height + BOTTOM], px_per_pt)?;
    sheet.heading(&chart.title, &chart.caption)?;
    let in_pi = [&x, &y].map(|axis| axis.scale == Scale::Pi);
    let panel = Panel::new(&sheet, [left, top, left + width, top + height], x, y);
    let panel = if in_pi == [true; 2] { panel.equal_steps() } else { panel };
    let pixels = (size[0] as usize, size[1] as usize);
    let cell = |column: usize, row: usize| {
        let place = |pixel: usize, pixels: usize, count: usize| {
            (pixel * count / pixels.max(1)).min(count.saturating_sub(1))
        };
        let (i, j) =
            (place(column, pixels.0, chart.x.count), place(pixels.1 - 1 - row, pixels.1, chart.y.count));
        colours.of_cell(chart.cells.get(i * chart.y.count + j).copied().unwrap_or(Cell::Failed))
    };
    sheet.raster([left, top], pixels, cell)?;
    panel.scales(WrittenParts { x: true, y_name_at: panel.name_place() })?;
    let mut at = left;
    for (colour, words) in legend {
        let top = top - AIR + 2.0 - SWATCH;
        sheet.polygon(&square(at, top, SWATCH), SPINE)?;
        sheet.polygon(&square(at + 0.5, top + 0.5, SWATCH - 1.0), colour)?;
        sheet.words(
            &words,
            note(GREY, Align::Left, TextLevel::Middle),
            [at + SWATCH + 4.0, top + 0.5 * SWATCH],
        )?;
        at += SWATCH + 4.0 + sheet.width(&words, NOTE, false) + 14.0;
    }
    bar(&sheet, &panel, &colours, px_per_pt)?;
    Ok(sheet.picture(&chart.title, &chart.caption))
}

fn square(left: f64, top: f64, side: f64) -> [[f64; 2]; 4] {
    [[left, top], [left + side, top], [left + side, top + side], [left, top + side]]
}

/// Colours of the cells without a value that occur, and what they mean.
fn legend(chart: &Map) -> Vec<(Colour, String)> {
    let kinds = [Cell::Never, Cell::Excluded, Cell::Failed];
    let colours = [WHITE, EXCLUDED, FAILED];
    let occurs = |kind: &Cell| chart.cells.iter().any(|cell| told(*cell) == *kind);
    let shown = kinds
        .iter()
        .zip(colours)
        .zip(&chart.words)
        .filter(|((kind, _), words)| occurs(kind) && !words.is_empty());
    shown.map(|((_, colour), words)| (colour, words.clone())).collect()
}

/// A value that is none is a failure.
fn told(cell: Cell) -> Cell {
    match cell {
        Cell::Value(value) if !value.is_finite() => Cell::Failed,
        cell => cell,
    }
}

/// The value of a cell that has one.
fn value(cell: Cell) -> Option<f64> {
    match told(cell) {
        Cell::Value(value) => Some(value),
        _ => None,
    }
}

/// Which value has which colour.
struct Colours {
    axis: Axis,
    dark_high: bool,
    /// True where values lie below, and above.
    beyond: [bool; 2],
    is_empty: bool,
}

impl Colours {
    fn of(chart: &Map) -> Self {
        let mut values: Vec<f64> = (chart.cells.iter())
            .filter_map(|cell| value(*cell))
            .filter(|&value| !chart.log || value > 0.0)
            .collect();
        let is_empty = values.is_empty();
        let range = chart.range.unwrap_or_else(|| {
            values.sort_by(f64::total_cmp);
            match (chart.log, values.first(), values.last()) {
                (true, Some(_), Some(&high)) => {
                    let quartile = |share: usize| values[share * (values.len() - 1) / 4];
                    // A few values near zero would leave one colour to all others.
                    let fence = quartile(1) / (quartile(3) / quartile(1)).clamp(MIDDLE, 1e100).powf(FENCE);
                    let inside = values.partition_point(|&value| value < fence);
                    let low = round_down(values[inside.max(values.len() / 100)]);
                    [low, if high >= 2.0 * low { high } else { 2.0 * low }]
                }
                (false, Some(&low), Some(&high)) if low < high => [low, high],
                (false, Some(&only), _) => [only - 0.5, only + 0.5],
                (true, ..) => [1.0, 10.0],
                (false, ..) => [0.0, 1.0],
            }
        });
        let scale = if chart.log { Scale::Log } else { Scale::Linear };
        // A logarithm has no place for zero: it is below everything.
        let all = || chart.cells.iter().filter_map(|cell| value(*cell));
        let beyond = [all().any(|value| value < range[0]), all().any(|value| value > range[1])];
        Self {
            axis: Axis { name: chart.value.clone(), scale, from: range[0], to: range[1], within: None },
            dark_high: chart.dark_high,
            beyond,
            is_empty,
        }
    }

    /// Ticks of a bar so high \[pt\]; those at its ends say where values lie beyond.
    fn ticks(&self, height: f64) -> Ticks {
        let mut ticks = self.axis.ticks(most_up(height));
        let place = |tick: &Tick| self.axis.fraction(tick.value);
        let is_log = self.axis.scale == Scale::Log;
        if is_log && self.beyond[0] && ticks.majors.first().is_some_and(|first| place(first) > 1e-9) {
            // Of what lies below the lower end has to be told.
            let lowest = Axis { to: 10.0 * self.axis.from, ..self.axis.clone() }.ticks(20).majors;
            ticks.majors.retain(|tick| place(tick) > 0.06);
            ticks.majors.splice(0..0, lowest.into_iter().filter(|tick| place(tick).abs() < 1e-9));
        }
        for tick in &mut ticks.majors {
            let near = |end: f64| (self.axis.fraction(tick.value) - end).abs() < 1e-9;
            if near(0.0) && self.beyond[0] {
                tick.label = format!("≤ {}", tick.label);
            } else if near(1.0) && self.beyond[1] {
                tick.label = format!("≥ {}", tick.label);
            }
        }
        ticks
    }

    /// Room right of the bar for ticks, their labels and the name \[pt\].
    fn room(&self, sheet: &Sheet, height: f64) -> f64 {
        let labels = self.ticks(height).majors;
        labels.iter().map(|tick| sheet.width(&tick.label, TICK, false)).fold(0.0, f64::max) + GAP + 8.0 + NAME
    }

    /// The colour at a share of the bar.
    fn at(&self, share: f64) -> Colour {
        let level = ((share.clamp(0.0, 1.0) * LEVELS).floor().min(LEVELS - 1.0) + 0.5) / LEVELS;
        even(if self.dark_high { 1.0 - level } else { level })
    }

    fn of_cell(&self, cell: Cell) -> Colour {
        match told(cell) {
            Cell::Value(value) => self.at(if self.axis.scale == Scale::Log && value <= 0.0 {
                0.0
            } else {
                self.axis.fraction(value)
            }),
            Cell::Never => WHITE,
            Cell::Excluded => EXCLUDED,
            Cell::Failed => FAILED,
        }
    }
}

/// The largest of 1, 2, 5 times a power of ten that is not above a positive value.
fn round_down(value: f64) -> f64 {
    let power = super::ticks::ten(value.log10().floor() as i32);
    [5.0, 2.0, 1.0]
        .into_iter()
        .map(|factor| factor * power)
        .find(|&round| round <= value * (1.0 + 1e-12))
        .unwrap_or(value)
}

/// The bar right of the map: its colours, ticks and name.
fn bar(sheet: &Sheet, panel: &Panel, colours: &Colours, px_per_pt: f64) -> Result<(), ChartError> {
    if colours.is_empty {
        return panel.empty("no values");
    }
    let [_, top, right, bottom] = panel.bounds;
    let (left, right) = (right + BAR[0], right + BAR[0] + BAR[1]);
    let pixels = [right - left, bottom - top].map(|points| (points * px_per_pt).round().max(1.0) as usize);
    sheet.raster([left, top], (pixels[0], pixels[1]), |_, row| {
        colours.at(1.0 - (row as f64 + 0.5) / pixels[1] as f64)
    })?;
    let spine = Pen::new(SPINE, 0.75);
    sheet.line(&[[left, top], [right, top], [right, bottom], [left, bottom], [left, top]], &spine)?;
    let ticks = colours.ticks(bottom - top);
    let height = |value: f64| bottom + (top - bottom) * colours.axis.fraction(value);
    for &value in &ticks.minors {
        sheet.line(&[[right, height(value)], [right + 2.2, height(value)]], &Pen::new(SPINE, 0.6))?;
    }
    for tick in &ticks.majors {
        let at = height(tick.value);
        sheet.line(&[[right, at], [right + 4.0, at]], &spine)?;
        sheet.words(
            &tick.label,
            Lettering::new(TICK, INK).at(Align::Left, TextLevel::Middle),
            [right + GAP, at],
        )?;
    }
    let upright =
        Lettering { angle: FRAC_PI_2, ..Lettering::new(NAME, INK).at(Align::Centre, TextLevel::Middle) };
    let at = right + colours.room(sheet, bottom - top) - 0.5 * NAME;
    sheet.words(&ticks.name(&colours.axis.name), upright, [at, 0.5 * (top + bottom)])
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    fn chart(cells: Vec<Cell>) -> Map {
        let axis = MapAxis {
            name: "*a* [rad]".into(),
            from: -1.5 * PI / 2.0,
            to: 1.5 * PI / 2.0,
            count: 4,
            log: false,
        };
        let words = ["never".to_owned(), "left out".to_owned(), "failed".to_owned()];
        Map {
            title: "Title".into(),
            x: axis.clone(),
            y: axis,
            cells,
            value: "time [s]".into(),
            log: true,
            words,
            ..Map::default()
        }
    }

    /// Colour in the middle of a cell.
    fn colour(picture: &Picture, column: usize, row: usize) -> [u8; 3] {
        let [left, top, right, bottom] = picture.panels[picture.panels.len() - 1];
        let share = |k: usize| (k as f64 + 0.5) / 4.0;
        let x = ((left + share(column) * (right - left)) * picture.px_per_pt) as usize;
        let y = ((bottom - share(row) * (bottom - top)) * picture.px_per_pt) as usize;
        let at = 3 * (y * picture.width as usize + x);
        [picture.rgb[at], picture.rgb[at + 1], picture.rgb[at + 2]]
    }

    #[test]
    fn every_cell_has_its_place_and_its_colour() {
        let mut cells = vec![Cell::Value(1.0); 16];
        (cells[1], cells[4], cells[15], cells[14]) =
            (Cell::Never, Cell::Excluded, Cell::Value(100.0), Cell::Value(f64::NAN));
        let picture = map(&chart(cells), 1.0).expect("a picture");
        let parts = |colour: Colour| [colour.0, colour.1, colour.2];
        assert_eq!(colour(&picture, 0, 0), parts(even(0.5 / LEVELS)));
        assert_eq!(colour(&picture, 0, 1), [255; 3], "the second of the first column");
        assert_eq!(colour(&picture, 1, 0), parts(EXCLUDED));
        assert_eq!(colour(&picture, 3, 3), parts(even(1.0 - 0.5 / LEVELS)));
        assert_eq!(colour(&picture, 3, 2), parts(FAILED), "not a number");
        let words: Vec<&str> = picture.texts.iter().map(|text| text.text.as_str()).collect();
        for word in ["never", "left out", "failed", "time [s]", "−π", "π", "0"] {
            assert!(words.contains(&word), "{word} in {words:?}");
        }
        for (k, text) in picture.texts.iter().enumerate() {
            let [left, top, right, bottom] = text.bounds();
            let size = [f64::from(picture.width), f64::from(picture.height)]
                .map(|pixels| pixels / picture.px_per_pt);
            assert!(
                left >= 0.0 && top >= 0.0 && right <= size[0] && bottom <= size[1],
                "{} is cut",
                text.text
            );
            assert!(picture.texts[..k].iter().all(|other| !other.overlaps(text)), "{} is covered", text.text);
        }
    }

    #[test]
    fn odd_data_draw_something_sensible() {
        for cells in [
            vec![],
            vec![Cell::Never; 16],
            vec![Cell::Value(0.0); 16],
            vec![Cell::Value(-3.0); 16],
            vec![Cell::Value(1e300); 16],
        ] {
            for log in [true, false] {
                assert!(map(&Map { log, ..chart(cells.clone()) }, 0.5).is_ok(), "{log} {cells:?}");
            }
        }
        let narrow = Map {
            x: MapAxis { count: 1, from: 2.0, to: 2.0, name: "x".into(), log: false },
            ..chart(vec![Cell::Value(1.0); 4])
        };
        assert!(map(&narrow, 0.5).is_ok());
    }

    #[test]
    fn the_lowest_tick_stands_for_zeros_as_well() {
        let mut cells: Vec<Cell> = (0..16).map(|k| Cell::Value(0.13 * 1.4_f64.powi(k))).collect();
        let has = |cells: &[Cell], word: &str| {
            let picture = map(&chart(cells.to_vec()), 1.0).expect("a picture");
            picture.texts.iter().any(|text| text.text == word)
        };
        assert!(has(&cells, "0.1"));
        cells[3] = Cell::Value(0.0);
        assert!(has(&cells, "≤ 0.1") && !has(&cells, "0.1"));
    }

    #[test]
    fn the_bar_says_where_values_are_cut_off() {
        let cells = (0..16).map(|k| Cell::Value(0.5 * f64::from(k))).collect();
        let picture =
            map(&Map { range: Some([1.0, 5.0]), log: false, ..chart(cells) }, 1.0).expect("a picture");
        let has = |word: &str| picture.texts.iter().any(|text| text.text == word);
        assert!(has("≤ 1.0") || has("≤ 1"), "{:?}", picture.texts);
        assert!(has("≥ 5.0") || has("≥ 5"), "{:?}", picture.texts);
    }
}
