//! Plots as SVG.

use std::path::Path;

use plotters::prelude::*;

use crate::error::CliError;

/// One line of a plot, or a cloud of points.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// The legend's text.
    pub name: String,
    /// Points with what is written beside them, if anything.
    pub points: Vec<(f64, f64, String)>,
    /// Whether the points are joined.
    pub joined: bool,
}

/// A plot with both axes named with their units.
#[derive(Debug, Clone, PartialEq)]
pub struct Plot<'a> {
    /// What it shows.
    pub title: &'a str,
    /// The x axis.
    pub x: &'a str,
    /// The y axis.
    pub y: &'a str,
    /// Whether the x axis is logarithmic.
    pub log_x: bool,
    /// What is drawn.
    pub series: &'a [Series],
}

fn range(values: impl Iterator<Item = f64>, log: bool) -> std::ops::Range<f64> {
    let (low, high) = values
        .filter(|v| v.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| {
            (l.min(v), h.max(v))
        });
    if low > high {
        return 1.0..2.0;
    }
    if log {
        return low.max(1e-12) / 1.3..high.max(2e-12) * 1.3;
    }
    let margin = 0.06 * (high - low).max(1e-9 + 0.05 * high.abs());
    low - margin..high + margin
}

impl Plot<'_> {
    /// Writes the plot, 800 x 500; points that are not finite are left out.
    ///
    /// # Errors
    /// [`CliError::Write`].
    pub fn write(&self, path: &Path) -> Result<(), CliError> {
        let mut text = String::new();
        self.draw(&mut text).map_err(|e| CliError::write(path, e))?;
        super::write_text(path, &text)
    }

    fn draw(&self, text: &mut String) -> Result<(), Box<dyn std::error::Error>> {
        let area = SVGBackend::with_string(text, (800, 500)).into_drawing_area();
        area.fill(&WHITE)?;
        let all = || self.series.iter().flat_map(|s| &s.points);
        let (x, y) = (
            range(all().map(|p| p.0), self.log_x),
            range(all().map(|p| p.1), false),
        );
        let mut builder = ChartBuilder::on(&area);
        builder
            .caption(self.title, ("sans-serif", 18))
            .margin(12)
            .x_label_area_size(46)
            .y_label_area_size(60);
        // The two axes are of different types, so that everything behind them is, too.
        macro_rules! fill {
            ($x:expr) => {{
                let mut chart = builder.build_cartesian_2d($x, y)?;
                chart
                    .configure_mesh()
                    .x_desc(self.x)
                    .y_desc(self.y)
                    .x_labels(16)
                    .light_line_style(WHITE)
                    .draw()?;
                for (k, series) in self.series.iter().enumerate() {
                    let color = Palette99::pick(k).to_rgba();
                    let points = || {
                        series
                            .points
                            .iter()
                            .filter(|p| p.0.is_finite() && p.1.is_finite())
                    };
                    if series.joined {
                        chart.draw_series(LineSeries::new(
                            points().map(|p| (p.0, p.1)),
                            color.stroke_width(2),
                        ))?;
                    }
                    chart
                        .draw_series(points().map(|p| {
                            EmptyElement::at((p.0, p.1))
                                + Circle::new((0, 0), 3, color.filled())
                                + Text::new(p.2.clone(), (5, -12), ("sans-serif", 11))
                        }))?
                        .label(&series.name)
                        .legend(move |(x, y)| Circle::new((x + 8, y), 4, color.filled()));
                }
                chart
                    .configure_series_labels()
                    .position(SeriesLabelPosition::LowerRight)
                    .background_style(WHITE.mix(0.85))
                    .border_style(BLACK.mix(0.3))
                    .draw()?;
            }};
        }
        if self.log_x {
            fill!(x.log_scale())
        } else {
            fill!(x)
        }
        area.present()?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plot_names_its_axes_and_series() {
        let series = [Series {
            name: "light steps 12".to_owned(),
            points: vec![
                (1.0, 20.0, "8".into()),
                (100.0, 40.0, String::new()),
                (2.0, f64::INFINITY, String::new()),
            ],
            joined: true,
        }];
        for log_x in [true, false] {
            let plot = Plot {
                title: "Error over time",
                x: "time [ms]",
                y: "PSNR [dB]",
                log_x,
                series: &series,
            };
            let mut text = String::new();
            plot.draw(&mut text).unwrap();
            for part in [
                "<svg",
                "Error over time",
                "time [ms]",
                "PSNR [dB]",
                "light steps 12",
            ] {
                assert!(text.contains(part), "{part}");
            }
        }
        let empty = Plot {
            title: "nothing",
            x: "x",
            y: "y",
            log_x: false,
            series: &[],
        };
        empty.draw(&mut String::new()).unwrap();
    }
}
