//! The mechanism in motion, as an animated GIF or PNG.

use super::ChartError;
use super::apng;
use super::file::write_whole;
use super::gif::GifEncoder;
use super::labels::Occupied;
use super::palette::{GREY, GRID};
use super::panel::{Panel, pale};
use super::sheet::{CAPTION, EDGE, Pen, Sheet};
use super::sketch::{Pencil, Pose, Sketch, sides_of_supports, symbol_size, trail_colour};
use super::text::{Align, Lettering, TextLevel};
use super::ticks::decimal;
use super::view::View;
use std::path::Path;

/// Width and height \[pt\], and pixels per point in each format; films need even numbers of pixels.
const SIZE: [f64; 2] = [210.0, 216.0];
const GIF: f64 = 2.0;
const APNG: f64 = 5.0;
/// Length of the fading trail \[frames\].
const TAIL: usize = 50;
/// Poses that the scale bar and the arrow of gravity keep clear of, and width of the time \[pt\].
const POSES: usize = 60;
const CLOCK: f64 = 110.0;
/// A speed that differs from 1 by less is told as none.
const SAME_SPEED: f64 = 0.05;
/// Few colours keep the file small.
const SHADES: usize = 20;

/// A mechanism frame by frame.
#[derive(Clone, Debug, Default)]
pub struct MotionGif {
    /// Title, with markup.
    pub title: String,
    /// The mechanism.
    pub sketch: Sketch,
    /// One pose a frame, at equal intervals.
    pub poses: Vec<Pose>,
    /// Time of each frame \[s\], written into it; may be empty.
    pub time: Vec<f64>,
    /// Paths of the sketch's points (x, y) \[m\], at equal intervals from the first frame to the last and
    /// finer than the frames.
    pub trails: Vec<Vec<[f64; 2]>>,
    /// Time a frame stays \[1/100 s\]; 4 gives 25 frames a second.
    pub delay: u16,
    /// The time from which on the paths are pale: the horizon up to which they can be trusted \[s\].
    pub horizon: Option<f64>,
}

/// A finished animation.
#[derive(Clone, Debug)]
pub struct Animation {
    /// The file.
    pub bytes: Vec<u8>,
}

impl Animation {
    /// Writes the file, replacing an older one at once.
    ///
    /// # Errors
    /// [`ChartError::Write`] if the folder does not exist or cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), ChartError> {
        write_whole(path, &self.bytes)
    }
}

/// Draws 420 × 432 px frames into an endless animation.
///
/// # Errors
/// [`ChartError`] if drawing or encoding fails.  An animation without poses has one empty frame.
pub fn motion_gif(chart: &MotionGif) -> Result<Animation, ChartError> {
    let frames = chart.poses.len().max(1);
    animated(chart, GIF, |[width, height], draw| {
        // Colours are chosen from a part of the frames, so that all of them never lie in memory together.
        let samples =
            (0..frames).step_by(frames.div_ceil(24)).map(&mut *draw).collect::<Result<Vec<_>, _>>()?;
        let mut encoder = GifEncoder::new(width, height, chart.delay.max(2), &samples)?;
        for k in 0..frames {
            encoder.frame(&draw(k)?)?;
        }
        encoder.finish()
    })
}

/// Draws 1050 × 1080 px frames into an endless animated PNG (W3C, "Portable Network Graphics, third edition",
/// 2025), in all their colours.
///
/// # Errors
/// As [`motion_gif`].
pub fn motion_apng(chart: &MotionGif) -> Result<Animation, ChartError> {
    let frames = chart.poses.len().max(1);
    animated(chart, APNG, |[width, height], draw| {
        let mut bytes = Vec::new();
        let mut encoder =
            apng::ApngEncoder::new(&mut bytes, [width, height], frames as u32, chart.delay.max(2))?;
        for k in 0..frames {
            encoder.frame(&draw(k)?)?;
        }
        encoder.finish()?;
        Ok(bytes)
    })
}

/// Pixels of a frame, by its number.
type Draw<'a> = dyn FnMut(usize) -> Result<Vec<u8>, ChartError> + 'a;

/// Draws frame after frame for an encoder.
fn animated(
    chart: &MotionGif,
    px_per_pt: f64,
    encode: impl FnOnce([u32; 2], &mut Draw) -> Result<Vec<u8>, ChartError>,
) -> Result<Animation, ChartError> {
    let sheet = Sheet::new(SIZE, px_per_pt)?;
    let under = sheet.heading(&chart.title, &[])?;
    let bounds = [EDGE, under + 8.0, SIZE[0] - EDGE, SIZE[1] - EDGE];
    let (width, height) = (bounds[2] - bounds[0], bounds[3] - bounds[1]);
    let view = View::around(&chart.sketch, &chart.poses, &chart.trails).fitted(width, height);
    let (x, y) = view.axes();
    let panel = Panel::new(&sheet, bounds, x, y);
    let [left, top, right, bottom] = bounds;
    sheet.line(
        &[[left, top], [right, top], [right, bottom], [left, bottom], [left, top]],
        &Pen::new(GRID, 0.75),
    )?;
    let size = 0.8 * chart.poses.first().map_or(1.0, |pose| symbol_size(pose, view.scale(width)));
    let sides = sides_of_supports(&chart.sketch, &chart.poses, &view);
    let pencil = Pencil { sheet: &sheet, panel: &panel, view, size, sides };
    let mut occupied = Occupied::default();
    pencil.walls(&chart.sketch.walls, &mut occupied)?;
    if let Some(pose) = chart.poses.first() {
        pencil.block_supports(&chart.sketch, pose, &mut occupied);
    }
    for pose in chart.poses.iter().step_by(chart.poses.len().div_ceil(POSES).max(1)) {
        pencil.block_bars(pose, &mut occupied);
    }
    if !chart.time.is_empty() {
        occupied.block([right - CLOCK, bottom - 5.0 - 2.25 * CAPTION, right, bottom]);
    }
    pencil.compass(&mut occupied)?;
    let (background, around) = (sheet.pixels(), occupied);
    let frames = chart.poses.len().max(1);
    let mut draw = |k: usize| -> Result<Vec<u8>, ChartError> {
        sheet.restore(&background);
        let Some(pose) = chart.poses.get(k) else { return Ok(sheet.pixels()) };
        let mut occupied = Occupied::default();
        let is_past = chart.horizon.zip(chart.time.get(k)).is_some_and(|(horizon, &time)| time > horizon);
        pencil.rails(&pose.sliders, &mut occupied)?;
        for (number, trail) in chart.trails.iter().enumerate() {
            let colour = trail_colour(number);
            pencil.trail(
                tail(trail, k, frames),
                if is_past { pale(colour) } else { colour },
                SHADES,
                &mut occupied,
            )?;
        }
        pencil.pose(&chart.sketch, pose, &mut occupied)?;
        // Over the mechanism, which may pass wherever the bar is.
        pencil.scale_bar(&mut around.clone())?;
        if let Some(&time) = chart.time.get(k) {
            let words = Lettering::new(CAPTION, GREY).at(Align::Right, TextLevel::Baseline);
            let past = if is_past { ", beyond trust" } else { "" };
            let (clock, speed) = clock(chart, time);
            sheet.words(&format!("{clock}{past}"), words, [right - 5.0, bottom - 5.0])?;
            sheet.words(&speed, words, [right - 5.0, bottom - 5.0 - 1.25 * CAPTION])?;
        }
        Ok(sheet.pixels())
    };
    let (width, height) = sheet.dimensions();
    Ok(Animation { bytes: encode([width, height], &mut draw)? })
}

/// What a frame says of its time, with as many digits as tell it from the next, and of the speed of time
/// where that is not its own.
fn clock(chart: &MotionGif, time: f64) -> (String, String) {
    let mut apart = 0.0;
    if let [first, .., last] = chart.time[..] {
        apart = (last - first) / (chart.time.len() - 1) as f64;
    }
    let decimals = if apart > 0.0 { (-apart.log10()).ceil().clamp(2.0, 12.0) } else { 2.0 };
    let clock = format!("*t* = {} s", decimal(time, decimals as usize));
    let speed = apart / (0.01 * f64::from(chart.delay.max(2)));
    let is_own = apart <= 0.0 || (speed - 1.0).abs() <= SAME_SPEED;
    if is_own {
        return (clock, String::new());
    }
    let digits = (1.0 - speed.log10().floor()).clamp(0.0, 9.0);
    (clock, format!("speed {} ×", decimal(speed, digits as usize)))
}

/// The part of a trail seen in frame `k`.
fn tail(trail: &[[f64; 2]], k: usize, frames: usize) -> &[[f64; 2]] {
    let place = |frame: usize| {
        (frame as f64 / (frames.max(2) - 1) as f64 * trail.len().saturating_sub(1) as f64).round() as usize
    };
    let end = (place(k) + 1).min(trail.len());
    &trail[place(k.saturating_sub(TAIL)).min(end)..end]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_tell_their_time_from_the_next_and_how_fast_it_goes() {
        let chart = |apart: f64| MotionGif {
            time: (0..5).map(|k| apart * f64::from(k)).collect(),
            delay: 4,
            ..MotionGif::default()
        };
        let told = |apart: f64, time: f64| clock(&chart(apart), time);
        assert_eq!(told(0.04, 0.4), ("*t* = 0.40 s".to_owned(), String::new()));
        assert_eq!(told(0.0006, 0.0012), ("*t* = 0.0012 s".to_owned(), "speed 0.015 ×".to_owned()));
        assert_eq!(told(0.4, 1.2).1, "speed 10 ×");
        assert_eq!(clock(&MotionGif::default(), 1.0), ("*t* = 1.00 s".to_owned(), String::new()));
    }
}
