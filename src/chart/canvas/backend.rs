//! The canvas as plotters sees it.

use super::{Canvas, UNITS, backend_colour, outline, points};
use crate::chart::mark::Mark;
use crate::chart::text::{Align, Lettering, TextLevel};
use plotters::style::FontTransform;
use plotters::style::text_anchor::{HPos, VPos};
use plotters_backend::{
    BackendColor, BackendCoord, BackendStyle, BackendTextStyle, DrawingBackend, DrawingErrorKind,
};
use std::convert::Infallible;
use tiny_skia::{PathBuilder, Rect};

type Drawn = Result<(), DrawingErrorKind<Infallible>>;

impl DrawingBackend for Canvas {
    type ErrorType = Infallible;

    fn get_size(&self) -> (u32, u32) {
        let [width, height] = self.drawing.size.map(|side| (side * UNITS).round() as u32);
        (width, height)
    }

    fn ensure_prepared(&mut self) -> Drawn {
        Ok(())
    }

    fn present(&mut self) -> Drawn {
        Ok(())
    }

    fn draw_pixel(&mut self, point: BackendCoord, color: BackendColor) -> Drawn {
        let pixel = points(point).map(|c| ((c * self.scale).floor() / self.scale) as f32);
        let side = (1.0 / self.scale) as f32;
        self.fill(Rect::from_xywh(pixel[0], pixel[1], side, side).map(PathBuilder::from_rect), color);
        Ok(())
    }

    fn draw_line<S: BackendStyle>(&mut self, from: BackendCoord, to: BackendCoord, style: &S) -> Drawn {
        self.draw_path([from, to], style)
    }

    fn draw_path<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(
        &mut self,
        path: I,
        style: &S,
    ) -> Drawn {
        let corners: Vec<BackendCoord> = path.into_iter().collect();
        match corners[..] {
            [] | [_] => {}
            [from, to] if from != to && (from.0 == to.0 || from.1 == to.1) => {
                let (colour, opacity) = backend_colour(style.color());
                let width = f64::from(style.stroke_width()) / UNITS;
                self.add(Mark::Rule { from: points(from), to: points(to), colour, opacity, width });
            }
            _ => self.stroke(outline(corners, false), style.color(), style.stroke_width(), true),
        }
        Ok(())
    }

    fn draw_rect<S: BackendStyle>(
        &mut self,
        upper_left: BackendCoord,
        bottom_right: BackendCoord,
        style: &S,
        fill: bool,
    ) -> Drawn {
        let ((left, top), (right, bottom)) = (upper_left, bottom_right);
        let corners = [(left, top), (right, top), (right, bottom), (left, bottom)];
        if fill {
            self.fill(outline(corners, true), style.color());
        } else {
            self.stroke(outline(corners, true), style.color(), style.stroke_width(), false);
        }
        Ok(())
    }

    fn draw_circle<S: BackendStyle>(
        &mut self,
        center: BackendCoord,
        radius: u32,
        style: &S,
        fill: bool,
    ) -> Drawn {
        let [x, y] = points(center).map(|c| c as f32);
        let circle = PathBuilder::from_circle(x, y, (f64::from(radius) / UNITS) as f32);
        if fill {
            self.fill(circle, style.color());
        } else {
            self.stroke(circle, style.color(), style.stroke_width(), false);
        }
        Ok(())
    }

    fn fill_polygon<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(
        &mut self,
        vert: I,
        style: &S,
    ) -> Drawn {
        self.fill(outline(vert, true), style.color());
        Ok(())
    }

    fn draw_text<T: BackendTextStyle>(&mut self, text: &str, style: &T, pos: BackendCoord) -> Drawn {
        let align = match style.anchor().h_pos {
            HPos::Left => Align::Left,
            HPos::Center => Align::Centre,
            HPos::Right => Align::Right,
        };
        let level = match style.anchor().v_pos {
            VPos::Top => TextLevel::Top,
            VPos::Center => TextLevel::Middle,
            VPos::Bottom => TextLevel::Baseline,
        };
        let quarters = match style.transform() {
            FontTransform::None => 0.0,
            FontTransform::Rotate90 => -1.0,
            FontTransform::Rotate180 => 2.0,
            FontTransform::Rotate270 => 1.0,
        };
        let (r, g, b) = style.color().rgb;
        let words = Lettering {
            angle: quarters * std::f64::consts::FRAC_PI_2,
            ..Lettering::new(style.size() / UNITS, plotters::style::RGBColor(r, g, b)).at(align, level)
        };
        self.words(text, &words, [f64::from(pos.0) / UNITS, f64::from(pos.1) / UNITS]);
        Ok(())
    }

    /// The height is that of a line: with the height of the capitals plotters sets its captions too tight.
    fn estimate_text_size<T: BackendTextStyle>(
        &self,
        text: &str,
        style: &T,
    ) -> Result<(u32, u32), DrawingErrorKind<Self::ErrorType>> {
        Ok((self.fonts.width(text, style.size(), false).ceil() as u32, (1.25 * style.size()).ceil() as u32))
    }
}
