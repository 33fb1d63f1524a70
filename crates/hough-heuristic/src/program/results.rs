//! The results: tables, pictures and remarks.

use std::collections::HashSet;
use std::error::Error;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::time::Duration;

use image::{GrayImage, RgbImage};

use super::Options;
use super::detector::{Searched, Staged};
use crate::a_contrario::Effort;
use crate::circle::Circle;
use crate::curve::Ellipse;
use crate::detect::Detection;
use crate::output::{write_png, write_whole};
use crate::stages::{with_circles, with_ellipses};

const COLUMNS: &str = "file,cx,cy,r,score,covered,visible,axis_ratio,centre_error,radius_error";
/// Columns of ellipses, after those.
const ELLIPSES: &str = ",major,minor,angle,major_error,minor_error,angle_error";

/// The results so far.
pub(super) struct Results<'a> {
    pub(super) options: &'a Options,
    csv: String,
    times: String,
    overlays: HashSet<String>,
    stages: HashSet<String>,
}

impl<'a> Results<'a> {
    pub(super) fn new(options: &'a Options) -> Self {
        Self {
            options,
            csv: String::new(),
            times: String::new(),
            overlays: HashSet::new(),
            stages: HashSet::new(),
        }
    }

    /// Returns `true` if the pictures are needed in their colours.
    pub(super) fn needs_colours(&self) -> bool {
        self.options.overlay.is_some()
    }

    /// Takes in the circles of one image and writes its pictures.
    pub(super) fn add(
        &mut self,
        path: &Path,
        frame: &GrayImage,
        colours: Option<RgbImage>,
        detector: &dyn Staged,
        searched: &Searched,
    ) -> Result<(), Box<dyn Error>> {
        let name = path.display().to_string();
        self.add_rows(&name, detector, searched)?;
        if let Some((_, effort)) = detector.details() {
            remark(&name, effort, self.options);
        }
        if self.options.csv.is_none() {
            print_table(&name, detector, searched);
        }
        if let Some(folder) = &self.options.stages {
            let folder = folder.join(unused_name(path, "", &mut self.stages));
            writable_folder(&folder)?;
            detector.stages().write(&folder, frame, &searched.found)?;
        }
        if let (Some(folder), Some(colours)) = (&self.options.overlay, colours) {
            let name = unused_name(path, ".png", &mut self.overlays);
            let ellipses: Vec<Ellipse> = detector.details().map_or(Vec::new(), |(all, _)| {
                let ellipses = all.iter().filter_map(|measurement| measurement.ellipse);
                ellipses.map(|measured| measured.ellipse).collect()
            });
            let picture = if ellipses.is_empty() {
                with_circles(colours, &searched.found)
            } else {
                with_ellipses(colours, &ellipses)
            };
            write_png(&folder.join(name), &picture)?;
        }
        Ok(())
    }

    fn add_rows(
        &mut self,
        name: &str,
        detector: &dyn Staged,
        searched: &Searched,
    ) -> Result<(), std::fmt::Error> {
        let name = quoted(name);
        for (index, Detection { circle, score }) in searched.found.iter().enumerate() {
            let Circle { x, y, radius } = circle;
            write!(self.csv, "{name},{x:.3},{y:.3},{radius:.3},{score:.4}")?;
            match detector.details() {
                Some((measurements, _)) => {
                    let m = &measurements[index];
                    let (covered, visible, ratio) = (m.covered, m.visible, m.axis_ratio);
                    write!(self.csv, ",{covered:.3},{visible:.3},{ratio:.4}")?;
                    write!(self.csv, ",{:.4},{:.4}", m.centre_error, m.radius_error)?;
                    if let Some(m) = &m.ellipse {
                        let (ellipse, angle) = (m.ellipse, m.ellipse.angle.to_degrees());
                        write!(
                            self.csv,
                            ",{:.3},{:.3},{angle:.3}",
                            ellipse.major, ellipse.minor
                        )?;
                        write!(self.csv, ",{:.4},{:.4}", m.major_error, m.minor_error)?;
                        write!(self.csv, ",{:.4}", m.angle_error.to_degrees())?;
                    }
                    writeln!(self.csv)?;
                }
                None => writeln!(self.csv, ",,,,,")?,
            }
        }
        let micros = |time: Duration| format!("{:.1}", time.as_secs_f64() * 1e6);
        let [edges, structure, search] = searched.stages.unwrap_or_default().map(|time| {
            let told = searched.stages.is_some();
            if told { micros(time) } else { String::new() }
        });
        let cpu = micros(searched.cpu);
        writeln!(self.times, "{name},{cpu},{edges},{structure},{search}")
    }

    /// Writes the tables that were asked for.
    pub(super) fn write(&self) -> Result<(), Box<dyn Error>> {
        let has_ellipses = self.options.min_axis_ratio.is_some_and(|ratio| ratio < 1.0);
        let more = if has_ellipses { ELLIPSES } else { "" };
        let csv = format!("{COLUMNS}{more}\n{}", self.csv);
        match &self.options.csv {
            Some(path) if path.as_os_str() == "-" => print_out(&csv),
            Some(path) => write_whole(path, csv.as_bytes())?,
            None => {}
        }
        if let Some(path) = &self.options.times {
            let header = "file,cpu_us,edges_us,structure_us,search_us";
            write_whole(path, format!("{header}\n{}", self.times).as_bytes())?;
        }
        Ok(())
    }
}

/// Tells that there may be more circles, and the option that finds them.
fn remark(name: &str, effort: Effort, options: &Options) {
    if effort.ended_by_budget {
        let remedy = match options.time_limit {
            Some(_) => "--time-limit or --draws",
            None => "--draws",
        };
        eprintln!("note: {name}: the budget ended the search; raise {remedy} to find more circles");
    }
    if effort.ended_by_count {
        eprintln!("note: {name}: more circles were found than --max-circles reports");
    }
}

fn print_table(name: &str, detector: &dyn Staged, searched: &Searched) {
    let millis = |time: Duration| format!("{:.2} ms", time.as_secs_f64() * 1e3);
    let (count, cpu) = (searched.found.len(), millis(searched.cpu));
    let mut table = format!("{name}: {count} circles, {cpu} of CPU time");
    if let Some(stages) = searched.stages {
        let [edges, structure, search] = stages.map(millis);
        table += &format!(" (wall time: edges {edges}, structure {structure}, search {search})");
    }
    table.push('\n');
    for (index, Detection { circle, score }) in searched.found.iter().enumerate() {
        let Circle { x, y, radius } = circle;
        table += &format!("  x {x:8.2}  y {y:8.2}  r {radius:7.2}  score {score:.3}");
        if let Some((measurements, _)) = detector.details() {
            let m = &measurements[index];
            let (covered, centre, radius) = (100.0 * m.covered, m.centre_error, m.radius_error);
            table += &format!("  covered {covered:3.0} %  errors {centre:.2} and {radius:.2} px");
            if let Some(Ellipse {
                major,
                minor,
                angle,
                ..
            }) = m.ellipse.map(|m| m.ellipse)
            {
                let angle = angle.to_degrees();
                table += &format!("  half-axes {major:.2} and {minor:.2} px at {angle:.1} degrees");
            }
        }
        table.push('\n');
    }
    print_out(&table);
}

/// Prints; a reader who has gone away is no reason to stop.
fn print_out(text: &str) {
    let _ = std::io::Write::write_all(&mut std::io::stdout(), text.as_bytes());
}

/// Creates the folder if need be, and checks that files can be written into it.
pub(super) fn writable_folder(folder: &Path) -> Result<(), String> {
    let probe = folder.join(".writable.part");
    fs::create_dir_all(folder)
        .and_then(|()| fs::write(&probe, b""))
        .and_then(|()| fs::remove_file(&probe))
        .map_err(|error| format!("{}: cannot be written to: {error}", folder.display()))
}

/// A CSV field: in quotes where the name has a comma, a quote or a line break in it.
fn quoted(name: &str) -> String {
    if name.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", name.replace('"', "\"\""))
    } else {
        name.to_owned()
    }
}

/// A name for what belongs to the image `path` that nothing of this run has yet.
fn unused_name(path: &Path, ending: &str, taken: &mut HashSet<String>) -> String {
    let stem = path
        .file_stem()
        .map_or("image".into(), |stem| stem.to_string_lossy().into_owned());
    let mut name = format!("{stem}{ending}");
    let mut number = 2;
    while !taken.insert(name.clone()) {
        name = format!("{stem}-{number}{ending}");
        number += 1;
    }
    name
}
