//! From a text to a formula: by precedence, on bytes.

use super::unit::{Dimension, Unit, find};
use super::{DEEPEST, FUNCTIONS, Formula, FormulaError, Interpolant, LONGEST, Node, meant};
use std::f64::consts::PI;

/// How strongly a sign binds: more than `*`, less than `^`.
const SIGN: u8 = 5;

pub(super) struct Parser<'a> {
    text: &'a str,
    at: usize,
    depth: usize,
    formula: Formula,
    tables: &'a [Interpolant],
}

pub(super) fn parse(text: &str, tables: &[Interpolant]) -> Result<Formula, FormulaError> {
    let mut parser = Parser::new(text, tables);
    if text.len() > LONGEST {
        return Err(parser.error(0, 1, "the formula is too long", &format!("at most {LONGEST} bytes")));
    }
    parser.expression(0)?;
    match parser.peek() {
        None => Ok(parser.formula),
        Some(byte) => Err(parser.rest(byte)),
    }
}

impl<'a> Parser<'a> {
    pub fn new(text: &'a str, tables: &'a [Interpolant]) -> Self {
        let formula = Formula {
            text: text.to_owned(),
            nodes: Vec::new(),
            constants: Vec::new(),
            units: Vec::new(),
            places: Vec::new(),
            names: Vec::new(),
            conditions: Vec::new(),
            held: Vec::new(),
            fixed: Vec::new(),
            tables: Vec::new(),
            active: Vec::new(),
        };
        Self { text, at: 0, depth: 0, formula, tables }
    }

    fn error(&self, start: usize, end: usize, problem: &str, hint: &str) -> FormulaError {
        FormulaError::new(self.text, start, end, problem.to_owned(), hint.to_owned())
    }

    /// At what stands here, though an operator or the end was expected.
    fn rest(&self, byte: u8) -> FormulaError {
        let (problem, hint) = match byte {
            b')' => ("this parenthesis closes nothing", "remove it, or open one before"),
            b',' => ("a comma outside of a function", "decimals are written with a point"),
            b'a'..=b'z' | b'A'..=b'Z' | b'_' | b'0'..=b'9' | b'.' | b'(' => (
                "an operator is missing here",
                "write products with *; units stand behind numbers, as 5 mm or 30 deg",
            ),
            b'<' | b'>' => ("a comparison outside of `if`", "write if(a < b, x, y)"),
            _ => (
                "this character has no meaning in a formula",
                "operators are + - * / ^, and units are written as in 90 deg or 5 mm",
            ),
        };
        self.error(self.at, self.at + 1, problem, hint)
    }

    /// The next byte that is no space.
    fn peek(&mut self) -> Option<u8> {
        let bytes = self.text.as_bytes();
        while let Some(b' ' | b'\t' | b'\r' | b'\n') = bytes.get(self.at) {
            self.at += 1;
        }
        bytes.get(self.at).copied()
    }

    fn push(&mut self, node: Node, start: usize, end: usize) -> usize {
        self.formula.push(node, (start, end))
    }

    /// Notes a condition and returns its number.
    fn condition(&mut self, node: usize) -> usize {
        self.formula.conditions.push(node);
        self.formula.conditions.len() - 1
    }

    /// What binds at least as strongly as `least`.
    fn expression(&mut self, least: u8) -> Result<usize, FormulaError> {
        self.depth += 1;
        if self.depth > DEEPEST {
            return Err(self.error(
                self.at,
                self.at + 1,
                "nested too deeply",
                &format!("at most {DEEPEST} levels"),
            ));
        }
        let mut left = self.operand()?;
        while let Some(operator) = self.peek() {
            let (strength, right) = match operator {
                b'+' | b'-' => (1, 2),
                b'*' | b'/' => (3, 4),
                b'^' => (7, SIGN),
                _ => break,
            };
            if strength < least {
                break;
            }
            let place = self.at;
            self.at += 1;
            let right = self.expression(right)?;
            let node = match operator {
                b'+' => Node::Sum(left, right),
                b'-' => Node::Difference(left, right),
                b'*' => Node::Product(left, right),
                b'/' => Node::Quotient(left, right),
                _ => Node::Power(left, right),
            };
            left = self.push(node, place, place + 1);
        }
        self.depth -= 1;
        Ok(left)
    }

    fn operand(&mut self) -> Result<usize, FormulaError> {
        let Some(byte) = self.peek() else {
            return Err(self.error(
                self.at,
                self.at + 1,
                "the formula ends too early",
                "a number, a name or ( is missing",
            ));
        };
        match byte {
            b'-' | b'+' => {
                let place = self.at;
                self.at += 1;
                let inner = self.expression(SIGN)?;
                Ok(if byte == b'-' { self.push(Node::Negative(inner), place, place + 1) } else { inner })
            }
            b'(' => {
                let start = self.at;
                self.at += 1;
                let inner = self.expression(0)?;
                self.close(start)?;
                Ok(inner)
            }
            b'0'..=b'9' | b'.' => self.number(),
            b'a'..=b'z' | b'A'..=b'Z' | b'_' => self.name(),
            _ => {
                let is_power = byte == b'*' && self.text[..self.at].ends_with('*');
                let hint =
                    if is_power { "powers are written with ^, as x^2" } else { "operators are + - * / ^" };
                Err(self.error(self.at, self.at + 1, "a number, a name or ( is missing here", hint))
            }
        }
    }

    /// The parenthesis that closes the one at `start`.
    fn close(&mut self, start: usize) -> Result<(), FormulaError> {
        match self.peek() {
            Some(b')') => {
                self.at += 1;
                Ok(())
            }
            None => Err(self.error(start, start + 1, "this parenthesis is never closed", "add ) at its end")),
            Some(byte) => Err(self.rest(byte)),
        }
    }

    /// The number that stands here, without its unit.
    pub fn digits(&mut self) -> &'a str {
        let (bytes, start) = (self.text.as_bytes(), self.at);
        let digits =
            |from: usize| from + bytes[from..].iter().take_while(|byte| byte.is_ascii_digit()).count();
        let mut end = digits(start);
        if bytes.get(end) == Some(&b'.') {
            end = digits(end + 1);
        }
        if let Some(b'e' | b'E') = bytes.get(end) {
            let signed = end + 1 + usize::from(matches!(bytes.get(end + 1), Some(b'+' | b'-')));
            if bytes.get(signed).is_some_and(u8::is_ascii_digit) {
                end = digits(signed);
            }
        }
        self.at = end;
        &self.text[start..end]
    }

    fn number(&mut self) -> Result<usize, FormulaError> {
        let start = self.at;
        let digits = self.digits();
        let end = self.at;
        let number = match digits.parse::<f64>() {
            Ok(number) if number.is_finite() => number,
            Ok(_) => return Err(self.error(start, end, "this number is too large", "at most 1.7e308")),
            Err(_) => return Err(self.error(start, end, "this is no number", "for example 0.5 or 1e-3")),
        };
        let units = self.units()?;
        let Some((&(first, power), others)) = units.split_first() else {
            return Ok(self.push(Node::Number(number), start, end));
        };
        let (mut above, mut below) = (first.above.powi(power), first.below.powi(power));
        let mut dimension = Dimension::NONE.times(first.dimension, f64::from(power));
        for &(unit, power) in others {
            let (more, less) = (unit.above.powi(power.abs()), unit.below.powi(power.abs()));
            let (more, less) = if power > 0 { (more, less) } else { (less, more) };
            (above, below) = (above * more, below * less);
            dimension = dimension.times(unit.dimension, f64::from(power));
        }
        let node = self.push(Node::Number(number * above / below), start, self.at);
        self.formula.units.push((node, dimension));
        Ok(node)
    }

    /// The units behind a number, as in `mm`, `N*s/m` or `m/s^2`, with their powers.
    pub fn units(&mut self) -> Result<Vec<(&'static Unit, i32)>, FormulaError> {
        let Some(b'a'..=b'z' | b'A'..=b'Z') = self.peek() else { return Ok(Vec::new()) };
        let (word, end) = self.word();
        let Some(first) = find(word) else {
            let hint = match word.contains('.') {
                true => format!("write products with *, as in 2*{word}"),
                false => {
                    let units: Vec<&str> = super::unit::UNITS.iter().map(|unit| unit.name).collect();
                    format!("{}; write products with *", meant(word, &units))
                }
            };
            let problem = format!("{word} is no unit");
            return Err(self.error(self.at, end, &problem, &hint));
        };
        self.at = end;
        let mut units = vec![(first, self.power_of_unit()?)];
        loop {
            let before = self.at;
            let sign = match self.peek() {
                Some(b'*') => 1,
                Some(b'/') => -1,
                _ => break,
            };
            self.at += 1;
            self.peek();
            let (word, end) = self.word();
            let Some(unit) = find(word) else {
                self.at = before;
                break;
            };
            self.at = end;
            units.push((unit, sign * self.power_of_unit()?));
        }
        Ok(units)
    }

    /// The letters that stand here, and where they end.
    fn word(&self) -> (&str, usize) {
        let bytes = self.text.as_bytes();
        let part = |byte: &&u8| byte.is_ascii_alphanumeric() || matches!(byte, b'_' | b'.');
        let end = self.at + bytes[self.at..].iter().take_while(part).count();
        (&self.text[self.at..end], end)
    }

    /// `^2` or `^-1` behind a unit; 1 where there is none.
    fn power_of_unit(&mut self) -> Result<i32, FormulaError> {
        if self.peek() != Some(b'^') {
            return Ok(1);
        }
        let start = self.at;
        self.at += 1;
        let sign = match self.peek() {
            Some(b'-') => -1,
            _ => 1,
        };
        self.at += usize::from(sign < 0);
        let digit = self.peek().filter(u8::is_ascii_digit).map(|digit| i32::from(digit - b'0'));
        self.at += usize::from(digit.is_some());
        let goes_on =
            self.text.as_bytes().get(self.at).is_some_and(|byte| matches!(byte, b'0'..=b'9' | b'.'));
        match digit {
            Some(digit @ 1..) if !goes_on && self.peek() != Some(b'^') => Ok(sign * digit),
            _ => Err(self.error(
                start,
                start + 1,
                "the power of a unit is not a whole number from 1 to 9 or -1 to -9",
                "for example m^2 or s^-1; a number with its unit is raised in parentheses, as (2 m)^0.5",
            )),
        }
    }

    fn name(&mut self) -> Result<usize, FormulaError> {
        let start = self.at;
        let (name, end) = self.word();
        let name = name.to_owned();
        self.at = end;
        let name = name.as_str();
        if self.peek() == Some(b'(') {
            return self.call(name.to_owned(), start, end);
        }
        if name == "pi" {
            return Ok(self.push(Node::Number(std::f64::consts::PI), start, end));
        }
        if name.split('.').any(str::is_empty) {
            return Err(self.error(start, end, "a part of this name is empty", "for example bar1.phi"));
        }
        if FUNCTIONS.iter().any(|known| known.0 == name) {
            return Err(self.error(
                start,
                end,
                &format!("{name} is a function"),
                &format!("write {name}(…)"),
            ));
        }
        let known = self.formula.names.iter().position(|known| known.0 == name);
        let number = known.unwrap_or_else(|| {
            self.formula.names.push((name.to_owned(), start));
            self.formula.names.len() - 1
        });
        Ok(self.push(Node::Name(number), start, end))
    }

    fn call(&mut self, name: String, start: usize, end: usize) -> Result<usize, FormulaError> {
        let table = self.tables.iter().find(|table| table.name == name);
        let known = FUNCTIONS.iter().find(|known| known.0 == name).map(|known| known.1);
        let Some(takes) = known.or(table.map(|_| 1)) else {
            let tables = self.tables.iter().map(|table| table.name.as_str());
            let hint = meant(&name, &tables.chain(FUNCTIONS.map(|known| known.0)).collect::<Vec<_>>());
            return Err(self.error(start, end, &format!("unknown function {name}"), &hint));
        };
        let open = self.at;
        self.at += 1;
        let mut arguments = vec![self.expression(0)?];
        let mut is_swapped = false;
        if name == "if" {
            (arguments[0], is_swapped) = self.compared(arguments[0])?;
        }
        let mut ends = vec![self.formula.nodes.len()];
        while self.peek() == Some(b',') {
            self.at += 1;
            arguments.push(self.expression(0)?);
            ends.push(self.formula.nodes.len());
        }
        self.close(open)?;
        if arguments.len() != takes {
            let given = arguments.len();
            let problem =
                format!("{name} takes {takes} argument{}, not {given}", if takes == 1 { "" } else { "s" });
            return Err(self.error(start, end, &problem, "arguments are separated by commas"));
        }
        if let Some(table) = table {
            return Ok(table.emit(&mut self.formula, arguments[0], (start, end)));
        }
        let first = arguments[0];
        let last = arguments[takes - 1];
        if let ("if", &[from, middle, to]) = (name.as_str(), &ends[..]) {
            let [holds, fails] = [from..middle, middle..to];
            self.formula.note_bases(first, if is_swapped { [fails, holds] } else { [holds, fails] });
        }
        let node = match name.as_str() {
            "sqrt" => Node::Root(first),
            "exp" => Node::Exponential(first),
            "log" => Node::Logarithm(first),
            "sin" => Node::Sine(first),
            "cos" => Node::Cosine(first),
            "tan" => Node::Tangent(first),
            "tanh" => Node::HyperbolicTangent(first),
            "atan2" => return Ok(self.angle(first, last, (start, end))),
            "pow" => Node::Power(first, last),
            // What branches hold at zero or above has no corner there.
            "abs" if self.formula.has_condition(first) && self.formula.range(first)[0] >= 0.0 => {
                return Ok(first);
            }
            "abs" => Node::Flip(self.condition(first), first),
            "sign" => {
                let one = self.push(Node::Number(1.0), start, end);
                self.formula.units.push((one, Dimension::NONE));
                Node::Flip(self.condition(first), one)
            }
            "min" | "max" => {
                let difference = self.push(Node::Difference(first, last), start, end);
                let condition = self.condition(difference);
                let [above, below] = if name == "max" { [first, last] } else { [last, first] };
                Node::Select(condition, above, below)
            }
            _ if is_swapped => Node::Select(self.condition(first), last, arguments[1]),
            _ => Node::Select(self.condition(first), arguments[1], last),
        };
        Ok(self.push(node, start, end))
    }

    /// The angle of (x, y), whose jump is a condition: where x < 0 it is that of (-x, -y) and half a turn, up
    /// or down by the sign of y, which chooses nothing elsewhere.
    fn angle(&mut self, y: usize, x: usize, (start, end): (usize, usize)) -> usize {
        let plain = Node::Angle(y, x);
        let is_constant = [y, x].iter().all(|&node| self.formula.constants[node].is_some());
        if is_constant || self.formula.range(x)[0] > 0.0 {
            return self.push(plain, start, end);
        }
        let [under, left] = [y, x].map(|node| self.push(Node::Negative(node), start, end));
        let is_left = self.condition(left);
        let nowhere = self.push(Node::Number(-1.0), start, end);
        let under_left = self.push(Node::Select(is_left, under, nowhere), start, end);
        let is_under_left = self.condition(under_left);
        let half = self.push(Node::Number(PI), start, end);
        self.formula.units.push((half, Dimension::NONE));
        let down = self.push(Node::Flip(is_under_left, half), start, end);
        let turned = self.push(Node::Angle(under, left), start, end);
        let on_the_left = self.push(Node::Difference(turned, down), start, end);
        let on_the_right = self.push(plain, start, end);
        self.push(Node::Select(is_left, on_the_left, on_the_right), start, end)
    }

    /// The right side of a comparison, if one stands here: what is positive where it holds; with true beside
    /// it, what is positive where it does not hold.  `a >= b` is not `a < b`, so that it holds where both are
    /// equal.
    fn compared(&mut self, left: usize) -> Result<(usize, bool), FormulaError> {
        let Some(operator @ (b'<' | b'>')) = self.peek() else { return Ok((left, false)) };
        let place = self.at;
        self.at += 1;
        let has_equality = self.text.as_bytes().get(self.at) == Some(&b'=');
        self.at += usize::from(has_equality);
        let right = self.expression(0)?;
        let is_less = (operator == b'<') != has_equality;
        let node = if is_less { Node::Difference(right, left) } else { Node::Difference(left, right) };
        Ok((self.push(node, place, place + 1), has_equality))
    }
}
