//! Plots as SVG.

use std::ops::Range;
use std::path::Path;

use plotters::coord::Shift;
use plotters::coord::ranged1d::{DefaultFormatting, KeyPointHint};
use plotters::prelude::*;

use crate::error::CliError;

/// A point of a plot.
#[derive(Debug, Clone, PartialEq)]
pub struct Point {
    /// Along the x axis.
    pub x: f64,
    /// Along the y axis.
    pub y: f64,
    /// What is written beside it, if anything.
    pub label: String,
    /// Drawn hollow when not: it scattered too much to conclude from.
    pub conclusive: bool,
}

/// One line of a plot, or a cloud of points.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// The legend's text.
    pub name: String,
    /// Points in the order in which they are joined.
    pub points: Vec<Point>,
    /// Whether the points are joined.
    pub joined: bool,
}

/// A plot with both axes named with their units.
#[derive(Debug, Clone, PartialEq)]
pub struct Plot<'a> {
    /// What it shows.
    pub title: &'a str,
    /// The x axis; "(logarithmic)" is added to it where it is.
    pub x: &'a str,
    /// The y axis; that it does not begin at 0 is added to it where it does not.
    pub y: &'a str,
    /// Whether the x axis is logarithmic; otherwise it begins at 0, or below for negative values.
    pub log_x: bool,
    /// Whether the y axis begins at 0.
    pub y_from_zero: bool,
    /// What is drawn.
    pub series: &'a [Series],
    /// Lines below the legend.
    pub notes: &'a [&'a str],
}

type Fault = Box<dyn std::error::Error>;
type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// Dark on white, and told apart by those who do not see red and green as well.
const COLORS: [RGBColor; 6] = [
    RGBColor(0, 84, 166),
    RGBColor(196, 60, 0),
    RGBColor(0, 112, 74),
    RGBColor(122, 28, 128),
    RGBColor(30, 30, 30),
    RGBColor(138, 100, 0),
];
const WIDTH: i32 = 800;
const CHART: i32 = 500;
const LINE: i32 = 20;
const LABEL: i32 = 11;

fn extremes(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    values.filter(|v| v.is_finite()).fold(None, |e, v| {
        Some(e.map_or((v, v), |(l, h): (f64, f64)| (l.min(v), h.max(v))))
    })
}

fn linear_range(values: impl Iterator<Item = f64>, from_zero: bool) -> Range<f64> {
    let Some((low, high)) = extremes(values) else {
        return 0.0..1.0;
    };
    if from_zero && low >= 0.0 {
        return 0.0..1.06 * high.max(1e-9);
    }
    let margin = 0.06 * (high - low).max(1e-9 + 0.05 * high.abs());
    low - margin..high + margin
}

/// Of the decadic logarithms.
fn log_range(values: impl Iterator<Item = f64>) -> Range<f64> {
    let (low, high) = extremes(values.filter(|v| *v > 0.0)).unwrap_or((1.0, 1.0));
    low.log10() - 0.12..high.log10() + 0.12
}

/// Some six round numbers within a range.
fn ticks(range: &Range<f64>) -> Vec<f64> {
    let rough = (range.end - range.start) / 7.0;
    let power = 10.0_f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0]
        .map(|m| m * power)
        .into_iter()
        .find(|s| *s >= rough)
        .unwrap_or(rough);
    let first = (range.start / step - 1e-9).ceil() as i64;
    let last = (range.end / step + 1e-9).floor() as i64;
    (first..=last).map(|k| k as f64 * step).collect()
}

/// The logarithms of round numbers within a range of logarithms: some to a power of ten, evenly spaced numbers where
/// these are too few, powers of ten where they are too many.
fn log_ticks(range: &Range<f64>) -> Vec<f64> {
    let decades = (range.start.floor() as i32)..=(range.end.ceil() as i32);
    let within = |list: Vec<f64>| -> Vec<f64> {
        list.into_iter()
            .map(f64::log10)
            .filter(|t| range.contains(t))
            .collect()
    };
    let of = |mantissas: &[f64]| {
        let powers = decades.clone().map(|d| 10.0_f64.powi(d));
        within(
            powers
                .flat_map(|p| mantissas.iter().map(move |m| m * p))
                .collect(),
        )
    };
    let dense = of(&[1.0, 1.5, 2.0, 3.0, 5.0, 7.0]);
    let list = if dense.len() > 12 {
        of(&[1.0, 2.0, 5.0])
    } else {
        dense
    };
    match list.len() {
        0..4 => within(
            ticks(&(10.0_f64.powf(range.start)..10.0_f64.powf(range.end)))
                .into_iter()
                .filter(|v| *v > 0.0)
                .collect(),
        ),
        4..=12 => list,
        _ => {
            let every = (range.end - range.start) as usize / 12 + 1;
            within(decades.step_by(every).map(|d| 10.0_f64.powi(d)).collect())
        }
    }
}

/// A linear axis with these ticks and no others.
#[derive(Debug, Clone)]
struct Axis {
    range: Range<f64>,
    ticks: Vec<f64>,
}

impl Ranged for Axis {
    type FormatOption = DefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, limit: (i32, i32)) -> i32 {
        let share = (value - self.range.start) / (self.range.end - self.range.start);
        limit.0 + (share * f64::from(limit.1 - limit.0)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, _: Hint) -> Vec<f64> {
        self.ticks.clone()
    }

    fn range(&self) -> Range<f64> {
        self.range.clone()
    }
}

/// A tick's number without digits that say nothing.
fn number(value: f64) -> String {
    if value != 0.0 && !(1e-4..1e6).contains(&value.abs()) {
        return format!("{value:.0e}");
    }
    let text = format!("{value:.6}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0" } else { text }.to_owned()
}

/// A series' mark: circle, square, triangle, diamond in turns.
fn mark(area: &Area, k: usize, at: (i32, i32), filled: bool) -> Result<(), Fault> {
    let color = COLORS[k % COLORS.len()];
    let (x, y) = at;
    let corners = match k % 4 {
        0 => {
            area.draw(&Circle::new(
                at,
                4,
                if filled { color } else { WHITE }.filled(),
            ))?;
            area.draw(&Circle::new(at, 4, color.stroke_width(2)))?;
            return Ok(());
        }
        1 => vec![
            (x - 4, y - 4),
            (x + 4, y - 4),
            (x + 4, y + 4),
            (x - 4, y + 4),
        ],
        2 => vec![(x, y - 5), (x + 5, y + 4), (x - 5, y + 4)],
        _ => vec![(x, y - 6), (x + 5, y), (x, y + 6), (x - 5, y)],
    };
    area.draw(&Polygon::new(
        corners.clone(),
        if filled { color } else { WHITE }.filled(),
    ))?;
    let closed: Vec<_> = corners.iter().chain(corners.first()).copied().collect();
    area.draw(&PathElement::new(closed, color.stroke_width(2)))?;
    Ok(())
}

/// What is taken already: boxes from the upper left to the lower right corner.
type Box4 = [i32; 4];

fn overlap(a: &Box4, b: &Box4) -> bool {
    a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3]
}

/// The place of a label beside a point that covers the least of what is taken.
fn place(at: (i32, i32), letters: usize, taken: &[Box4]) -> Box4 {
    let (w, h) = (letters as i32 * 7, LABEL + 1);
    let (x, y) = at;
    [
        (x + 6, y - h - 4),
        (x - w - 6, y - h - 4),
        (x + 6, y + 4),
        (x - w - 6, y + 4),
        (x - w / 2, y - h - 8),
        (x - w / 2, y + 8),
        (x + 9, y - h / 2),
        (x - w - 9, y - h / 2),
    ]
    .map(|(x, y)| [x, y, x + w, y + h])
    .into_iter()
    .min_by_key(|place| taken.iter().filter(|t| overlap(place, t)).count())
    .unwrap_or([x, y, x, y])
}

impl Plot<'_> {
    /// Writes the plot, 800 wide, with the legend below; points that are not finite are left out.
    ///
    /// # Errors
    /// [`CliError::Write`].
    pub fn write(&self, path: &Path) -> Result<(), CliError> {
        let mut text = String::new();
        self.draw(&mut text).map_err(|e| CliError::write(path, e))?;
        super::write_text(path, &text)
    }

    fn place_of(&self, point: &Point) -> (f64, f64) {
        (if self.log_x { point.x.log10() } else { point.x }, point.y)
    }

    fn draw(&self, text: &mut String) -> Result<(), Fault> {
        let shown = |s: &Series| -> Vec<Point> {
            let finite = |p: &&Point| {
                let (x, y) = self.place_of(p);
                x.is_finite() && y.is_finite()
            };
            s.points.iter().filter(finite).cloned().collect()
        };
        let series: Vec<(&str, bool, Vec<Point>)> = self
            .series
            .iter()
            .map(|s| (s.name.as_str(), s.joined, shown(s)))
            .collect();
        let all = || series.iter().flat_map(|s| &s.2);
        let mut notes = self.notes.to_vec();
        if all().any(|p| !p.conclusive) {
            notes.insert(0, "hollow: the times scattered too much to conclude from");
        }
        let height = CHART + LINE * (series.len() + notes.len()) as i32 + 12;
        let area = SVGBackend::with_string(text, (WIDTH as u32, height as u32)).into_drawing_area();
        area.fill(&WHITE)?;
        let x = if self.log_x {
            log_range(all().map(|p| p.x))
        } else {
            linear_range(all().map(|p| p.x), true)
        };
        let y = linear_range(all().map(|p| p.y), self.y_from_zero);
        let x_name = format!(
            "{}{}",
            self.x,
            if self.log_x { " (logarithmic)" } else { "" }
        );
        let partial = !y.contains(&0.0);
        let y_name = format!(
            "{}{}",
            self.y,
            if partial { "; does not begin at 0" } else { "" }
        );
        let (x_ticks, y_ticks) = (
            if self.log_x { log_ticks(&x) } else { ticks(&x) },
            ticks(&y),
        );
        let (chart_area, _) = area.split_vertically(CHART);
        let mut chart = ChartBuilder::on(&chart_area)
            .caption(self.title, ("sans-serif", 18))
            .margin(12)
            .margin_right(24)
            .x_label_area_size(46)
            .y_label_area_size(64)
            .build_cartesian_2d(
                Axis {
                    range: x,
                    ticks: x_ticks,
                },
                Axis {
                    range: y,
                    ticks: y_ticks,
                },
            )?;
        chart
            .configure_mesh()
            .x_desc(x_name)
            .y_desc(y_name)
            .x_label_formatter(&|v| number(if self.log_x { 10.0_f64.powf(*v) } else { *v }))
            .y_label_formatter(&|v| number(*v))
            .bold_line_style(RGBColor(215, 215, 215))
            .light_line_style(WHITE)
            .label_style(("sans-serif", 13))
            .axis_desc_style(("sans-serif", 14))
            .draw()?;
        let pixels: Vec<Vec<(i32, i32)>> = series
            .iter()
            .map(|s| {
                let at = |p: &Point| chart.backend_coord(&self.place_of(p));
                s.2.iter().map(at).collect()
            })
            .collect();
        // Lines, then marks, then labels, so that no line lies over a mark.
        let mut taken: Vec<Box4> = Vec::new();
        for (k, line) in pixels.iter().enumerate().filter(|(k, _)| series[*k].1) {
            let color = COLORS[k % COLORS.len()];
            area.draw(&PathElement::new(line.clone(), color.stroke_width(2)))?;
            for ends in line.windows(2) {
                let (a, b) = (ends[0], ends[1]);
                let parts = ((b.0 - a.0).abs().max((b.1 - a.1).abs()) / 4).max(1);
                taken.extend((0..=parts).map(|i| {
                    let x = a.0 + (b.0 - a.0) * i / parts;
                    let y = a.1 + (b.1 - a.1) * i / parts;
                    [x - 1, y - 1, x + 1, y + 1]
                }));
            }
        }
        for (k, (_, _, points)) in series.iter().enumerate() {
            let many = points.len() > 24;
            for (point, at) in points.iter().zip(&pixels[k]) {
                if many {
                    let color = COLORS[k % COLORS.len()];
                    area.draw(&Circle::new(*at, 2, color.filled()))?;
                } else {
                    mark(&area, k, *at, point.conclusive)?;
                }
                // A mark counts for more than a line.
                taken.extend([[at.0 - 5, at.1 - 5, at.0 + 5, at.1 + 5]; 4]);
            }
        }
        for (k, (_, _, points)) in series.iter().enumerate() {
            for (point, at) in points.iter().zip(&pixels[k]) {
                if !point.label.is_empty() {
                    let place = place(*at, point.label.chars().count(), &taken);
                    let style = ("sans-serif", LABEL)
                        .into_font()
                        .color(&COLORS[k % COLORS.len()]);
                    area.draw(&Text::new(point.label.clone(), (place[0], place[1]), style))?;
                    taken.extend([place; 8]);
                }
            }
        }
        self.legend(&area, &series, &notes)?;
        area.present()?;
        Ok(())
    }

    fn legend(
        &self,
        area: &Area,
        series: &[(&str, bool, Vec<Point>)],
        notes: &[&str],
    ) -> Result<(), Fault> {
        const LEFT: i32 = 76;
        let mut y = CHART + LINE / 2;
        for (k, (name, joined, points)) in series.iter().enumerate() {
            if *joined {
                let color = COLORS[k % COLORS.len()];
                let line = vec![(LEFT, y), (LEFT + 36, y)];
                area.draw(&PathElement::new(line, color.stroke_width(2)))?;
            }
            if points.len() <= 24 {
                mark(area, k, (LEFT + 18, y), true)?;
            }
            area.draw(&Text::new(
                (*name).to_owned(),
                (LEFT + 46, y - 7),
                ("sans-serif", 14),
            ))?;
            y += LINE;
        }
        for note in notes {
            area.draw(&Text::new(
                (*note).to_owned(),
                (LEFT, y - 7),
                ("sans-serif", 14),
            ))?;
            y += LINE;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(x: f64, y: f64, label: &str, conclusive: bool) -> Point {
        Point {
            x,
            y,
            label: label.to_owned(),
            conclusive,
        }
    }

    #[test]
    fn a_plot_names_its_axes_and_series() {
        let series = [Series {
            name: "light steps 12".to_owned(),
            points: vec![
                point(1.0, 20.0, "8", true),
                point(100.0, 40.0, "", false),
                point(2.0, f64::INFINITY, "left out", true),
            ],
            joined: true,
        }];
        for log_x in [true, false] {
            let plot = Plot {
                title: "Error over time",
                x: "time [ms]",
                y: "PSNR [dB]",
                log_x,
                y_from_zero: !log_x,
                series: &series,
                notes: &["a note"],
            };
            let mut text = String::new();
            plot.draw(&mut text).unwrap();
            for part in [
                "<svg",
                "Error over time",
                "time [ms]",
                "PSNR [dB]",
                "light steps 12",
                "a note",
                "hollow",
            ] {
                assert!(text.contains(part), "{part}");
            }
            assert_eq!(text.contains("(logarithmic)"), log_x);
            assert_eq!(text.contains("does not begin at 0"), log_x);
            assert!(!text.contains("left out"));
        }
        let empty = Plot {
            title: "nothing",
            x: "x",
            y: "y",
            log_x: false,
            y_from_zero: false,
            series: &[],
            notes: &[],
        };
        empty.draw(&mut String::new()).unwrap();
    }

    #[test]
    fn logarithmic_axes_have_several_ticks_apart_from_each_other() {
        for (low, high) in [
            (0.95, 1.05),
            (0.4, 1.2),
            (0.42, 12.6),
            (0.3, 3.0),
            (1e-3, 1e3),
            (1e-12, 1e12),
            (2.0, 2.0),
        ] {
            let range = log_range([low, high].into_iter());
            let list = log_ticks(&range);
            assert!((3..=13).contains(&list.len()), "{low} to {high}: {list:?}");
            if low < 0.9 {
                assert!(list.iter().filter(|t| **t < 0.0).count() >= 2, "{list:?}");
            }
            for pair in list.windows(2) {
                let share = (pair[1] - pair[0]) / (range.end - range.start);
                assert!(
                    share * f64::from(WIDTH - 112) > 24.0,
                    "{low} to {high}: {list:?}"
                );
            }
        }
        assert_eq!(number(0.30000000000000004), "0.3");
        assert_eq!(number(20.0), "20");
        assert_eq!(number(-0.0), "0");
        assert_eq!(number(1e-9), "1e-9");
    }

    #[test]
    fn labels_keep_clear_of_what_is_drawn() {
        let mark = [95, 95, 105, 105];
        let first = place((100, 100), 2, &[mark]);
        assert!(!overlap(&first, &mark));
        let second = place((100, 100), 2, &[mark, first]);
        assert!(!overlap(&second, &first) && !overlap(&second, &mark));
    }
}
