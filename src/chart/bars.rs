//! Signed values as bars from a common zero, in groups, each with its name and figure.

use super::file::Picture;
use super::grid::AIR;
use super::names::shortened_apart;
use super::palette::{BLUE, GREY, GUIDE, INK, VERMILLION};
use super::sheet::{Pen, Sheet, note};
use super::text::{Align, Lettering, TextLevel};
use super::ticks::figure;
use super::{ChartError, PAGE};

/// Height of a bar with its room, of a group's name, and between groups \[pt\].
const PITCH: f64 = 15.0;
const HEAD: f64 = 17.0;
const APART: f64 = 8.0;
/// Room for figures on both sides \[pt\].
const FIGURE: f64 = 62.0;

/// Values of one quantity.
#[derive(Clone, Debug, Default)]
pub struct BarGroup {
    /// Name, with markup.
    pub name: String,
    /// Unit of the figures, with markup.
    pub unit: String,
    /// Names, with markup, and values.
    pub bars: Vec<(String, f64)>,
}

/// Groups of bars.
#[derive(Clone, Debug, Default)]
pub struct Bars {
    /// Title, with markup.
    pub title: String,
    /// Parts of the caption, with markup.
    pub caption: Vec<String>,
    /// The groups, each with a scale of its own.
    pub groups: Vec<BarGroup>,
}

/// Draws every group, negative values to the left in red.
///
/// # Errors
/// [`ChartError`] if the resolution is out of range or drawing fails.
pub fn bars(chart: &Bars, px_per_pt: f64) -> Result<Picture, ChartError> {
    let under = Sheet::new(PAGE, 0.5)?.heading(&chart.title, &chart.caption)?;
    let height = |group: &BarGroup| HEAD + PITCH * group.bars.len().max(1) as f64 + APART;
    let size = [PAGE[0], under + AIR + chart.groups.iter().map(height).sum::<f64>().max(40.0)];
    let sheet = Sheet::new(size, px_per_pt)?;
    sheet.heading(&chart.title, &chart.caption)?;
    let of_group =
        |group: &BarGroup| shortened_apart(&sheet, group.bars.iter().map(|(name, _)| name.as_str()));
    let names: Vec<Vec<String>> = chart.groups.iter().map(of_group).collect();
    let width = |name: &String| sheet.width(name, super::sheet::NOTE, false);
    let left = 16.0 + names.iter().flatten().map(width).fold(40.0, f64::max);
    let (from, to) = (left + 10.0, PAGE[0] - 16.0);
    let mut top = under + AIR;
    for (group, names) in chart.groups.iter().zip(&names) {
        let unit = if group.unit.is_empty() { String::new() } else { format!(" [{}]", group.unit) };
        let name = format!("{}{unit}", group.name);
        sheet.words(
            &name,
            Lettering::new(super::sheet::NAME, INK).at(Align::Left, TextLevel::Middle),
            [16.0, top + 6.0],
        )?;
        let values = || group.bars.iter().map(|(_, value)| *value).filter(|value| value.is_finite());
        let (least, most) = values().fold((0.0, 0.0), |(low, high): (f64, f64), v| (low.min(v), high.max(v)));
        let span = if most > least { most - least } else { 1.0 };
        let rooms = [if least < 0.0 { FIGURE } else { 0.0 }, FIGURE];
        let at = |value: f64| from + rooms[0] + (value - least) / span * (to - from - rooms[0] - rooms[1]);
        let bottom = top + HEAD + PITCH * group.bars.len() as f64;
        sheet.line(&[[at(0.0), top + HEAD - 3.0], [at(0.0), bottom]], &Pen::new(GUIDE, 0.8))?;
        for (k, ((_, value), name)) in group.bars.iter().zip(names).enumerate() {
            let middle = top + HEAD + PITCH * (k as f64 + 0.4);
            sheet.words(name, note(INK, Align::Right, TextLevel::Middle), [left, middle])?;
            if !value.is_finite() {
                sheet.words("none", note(GREY, Align::Left, TextLevel::Middle), [at(0.0) + 5.0, middle])?;
                continue;
            }
            let (end, colour) = (at(*value), if *value < 0.0 { VERMILLION } else { BLUE });
            let (low, high) = (middle - 4.2, middle + 4.2);
            sheet.polygon(&[[at(0.0), low], [end, low], [end, high], [at(0.0), high]], colour)?;
            let (align, x) = if *value < 0.0 { (Align::Right, end - 5.0) } else { (Align::Left, end + 5.0) };
            sheet.words(&figure(*value), note(GREY, align, TextLevel::Middle), [x, middle])?;
        }
        top += height(group);
    }
    Ok(sheet.picture(&chart.title, &chart.caption))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn negative_values_are_red_and_positive_ones_blue() {
        for (value, is_red) in [(-2.0, true), (3.0, false), (f64::NAN, false), (0.0, false)] {
            let bars_of = vec![("p".to_owned(), value)];
            let group = BarGroup { name: "y".into(), unit: "rad".into(), bars: bars_of };
            let chart = Bars { groups: vec![group], ..Bars::default() };
            let picture = bars(&chart, 1.0).expect("a picture");
            let any = |is: &dyn Fn(u8, u8) -> bool| {
                picture.rgb.as_chunks::<3>().0.iter().any(|&[red, _, blue]| is(red, blue))
            };
            assert_eq!(any(&|red, blue| red > 180 && blue < 60), is_red, "{value}");
            assert_eq!(any(&|red, blue| red < 60 && blue > 150), value > 0.0, "{value}");
        }
    }
}
