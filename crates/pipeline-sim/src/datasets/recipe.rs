//! The table of recipes.

use nalgebra::Vector3;
use rand::{Rng, RngExt};

use crate::cell::camera::Camera;
use crate::datasets::snapshot::{Exposure, Snapshot, View};
use crate::datasets::stage::{Stage, other_than};
use crate::datasets::things::{cables, lamps, things};
use crate::error::QuantityError;
use crate::render::renderer::Renderer;
use crate::render::scene::{Appearance, Scene, Sensor};
use crate::render::shot::Shot;

/// A recipe for labelled frames of one kind of difficulty.
///
/// The recipes of [`Recipe::cell`] show the arm at work: a random ball, a pose on the way to it,
/// and a scene that several frames can share. Those of [`Recipe::benchmark`] isolate one difficulty
/// for a circle detector: the camera looks down on balls on a table whose radii are log-uniform
/// over 12..145 pixels of a frame of 768x576, and everything else has straight edges.
///
/// ```
/// use pipeline_sim::Recipe;
/// use pipeline_sim::rand::{SeedableRng, rngs::Xoshiro256PlusPlus};
///
/// fn main() -> Result<(), Box<dyn std::error::Error>> {
///     let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
///     let (mut renderer, snapshot) = Recipe::named("clutter")?.draw((768, 576), &mut rng)?;
///     let frame = snapshot.take(&mut renderer);
///     assert_eq!(frame.dimensions(), (768, 576));
///     assert!(!snapshot.truth(&renderer).is_empty());
///     Ok(())
/// }
/// ```
#[derive(Debug)]
pub struct Recipe {
    name: &'static str,
    summary: &'static str,
    kind: Kind,
}

#[derive(Debug)]
enum Kind {
    Cell(CellRecipe),
    Benchmark(BenchmarkRecipe),
}

/// The arm at work.
#[derive(Debug)]
struct CellRecipe {
    /// Greatest number of things on the table.
    things: usize,
    /// Taller cylinders.
    tall: bool,
    /// Change of the scene.
    change: fn(&mut Scene, &mut dyn Rng),
    view: View,
}

/// Balls on a table under the camera.
#[derive(Clone, Copy, Debug)]
struct BenchmarkRecipe {
    balls: usize,
    /// Least and greatest radius of the balls, pixels of a frame of 768x576.
    radii: (f64, f64),
    /// Number of things with straight edges.
    distractors: usize,
    /// Range of the grain of the table.
    grain: (f64, f64),
    /// Reflectance of the first ball, from that of the table.
    albedo: fn(f64, &mut dyn Rng) -> f64,
    /// Range of the noise, gray levels; `None` for the sensor's own.
    noise: Option<(f64, f64)>,
    /// Fraction of the first ball's outline that is hidden.
    hidden: f64,
    /// Range of the motion during the exposure, pixels of 768.
    motion: Option<(f64, f64)>,
}

const CELL: CellRecipe = CellRecipe {
    things: 70,
    tall: false,
    change: |_, _| {},
    view: View {
        barrel: false,
        empty: false,
        exposure: Exposure::Still,
    },
};

const BENCHMARK: BenchmarkRecipe = BenchmarkRecipe {
    balls: 1,
    radii: (12.0, 145.0),
    distractors: 0,
    grain: (0.15, 0.15),
    albedo: |_, rng| rng.random_range(0.70..0.90),
    noise: None,
    hidden: 0.0,
    motion: None,
};

const fn cell(name: &'static str, summary: &'static str, recipe: CellRecipe) -> Recipe {
    Recipe {
        name,
        summary,
        kind: Kind::Cell(recipe),
    }
}

const fn benchmark(name: &'static str, summary: &'static str, recipe: BenchmarkRecipe) -> Recipe {
    Recipe {
        name,
        summary,
        kind: Kind::Benchmark(recipe),
    }
}

/// Coarse grain of a crowded table.
const CROWDED: CellRecipe = CellRecipe {
    things: 170,
    change: |scene, rng| scene.table.texture = rng.random_range(0.7..1.0),
    ..CELL
};

static CELL_RECIPES: [Recipe; 12] = [
    cell(
        "plain",
        "a light ball over a bare, slightly textured table",
        CellRecipe {
            things: 0,
            change: |scene, _| scene.table.texture = 0.15,
            ..CELL
        },
    ),
    cell("things", "a wooden table with some things on it", CELL),
    cell(
        "clutter",
        "a strongly grained table crowded with things, print and other balls",
        CROWDED,
    ),
    cell(
        "occluded",
        "things; cables before the lens and tall things beside the ball",
        CellRecipe {
            tall: true,
            change: |scene, rng| scene.occluders = cables(rng),
            ..CELL
        },
    ),
    cell(
        "noise",
        "things; little light and a high gain",
        CellRecipe {
            change: |scene, rng| {
                scene.sensor.exposure = rng.random_range(0.35..0.6);
                scene.sensor.read_noise = rng.random_range(6.0..14.0);
                scene.sensor.shot_noise = rng.random_range(8.0..16.0);
            },
            ..CELL
        },
    ),
    cell(
        "dark",
        "things; a dark ball and a dull lamp: little contrast, of changing sign",
        CellRecipe {
            change: |scene, rng| {
                scene.ball.albedo = rng.random_range(0.04..0.14);
                scene.ball.gloss = rng.random_range(0.0..0.15);
                scene.sensor.exposure = rng.random_range(0.6..0.9);
            },
            ..CELL
        },
    ),
    cell(
        "camouflage",
        "things; a ball as bright as the table and a lamp from the side",
        CellRecipe {
            change: |scene, rng| {
                scene.ball.albedo = scene.table.albedo * rng.random_range(0.85..1.15);
                scene.ball.gloss = rng.random_range(0.0..0.1);
                let angle = rng.random_range(0.0..std::f64::consts::TAU);
                scene.lights.truncate(1);
                scene.lights[0].toward = Vector3::new(1.6 * angle.cos(), 1.6 * angle.sin(), 1.0);
            },
            ..CELL
        },
    ),
    cell(
        "defocus",
        "things; out of focus",
        CellRecipe {
            change: |scene, rng| scene.sensor.defocus = rng.random_range(1.0..3.5),
            ..CELL
        },
    ),
    cell(
        "motion",
        "things; the arm moves while the shutter is open",
        CellRecipe {
            view: View {
                exposure: Exposure::Motion,
                ..CELL.view
            },
            ..CELL
        },
    ),
    cell(
        "interlaced",
        "motion in two fields 20 ms apart",
        CellRecipe {
            view: View {
                exposure: Exposure::Interlaced,
                ..CELL.view
            },
            ..CELL
        },
    ),
    cell(
        "distorted",
        "things; a lens with barrel distortion",
        CellRecipe {
            view: View {
                barrel: true,
                ..CELL.view
            },
            ..CELL
        },
    ),
    cell(
        "empty",
        "clutter without the ball",
        CellRecipe {
            view: View {
                empty: true,
                ..CELL.view
            },
            ..CROWDED
        },
    ),
];

/// Five things with straight edges beside the ball.
const DISTRACTORS: BenchmarkRecipe = BenchmarkRecipe {
    distractors: 5,
    ..BENCHMARK
};

/// No ball.
const EMPTY: BenchmarkRecipe = BenchmarkRecipe {
    balls: 0,
    ..DISTRACTORS
};

const fn noisy(noise: f64, recipe: BenchmarkRecipe) -> BenchmarkRecipe {
    BenchmarkRecipe {
        noise: Some((noise, noise)),
        ..recipe
    }
}

static BENCHMARK_RECIPES: [Recipe; 14] = [
    benchmark("clean", "a ball on a bare table", BENCHMARK),
    benchmark(
        "distractors",
        "five boxes, tapes and sheets of print beside the ball",
        DISTRACTORS,
    ),
    benchmark(
        "occluded-40",
        "40 % of the outline hidden by a straight edge",
        BenchmarkRecipe {
            hidden: 0.4,
            ..BENCHMARK
        },
    ),
    benchmark(
        "noise-10",
        "noise of 10 gray levels",
        noisy(10.0, BENCHMARK),
    ),
    benchmark(
        "noise-25",
        "noise of 25 gray levels",
        noisy(25.0, BENCHMARK),
    ),
    benchmark(
        "noise-40",
        "noise of 40 gray levels",
        noisy(40.0, BENCHMARK),
    ),
    benchmark(
        "many",
        "twenty balls of 12..60 pixels",
        BenchmarkRecipe {
            balls: 20,
            radii: (12.0, 60.0),
            ..BENCHMARK
        },
    ),
    benchmark(
        "motion-blur",
        "motion of 4 to 12 pixels (of 768) during the exposure",
        BenchmarkRecipe {
            motion: Some((4.0, 12.0)),
            ..BENCHMARK
        },
    ),
    benchmark(
        "dark-ball",
        "a ball darker than the table",
        BenchmarkRecipe {
            albedo: |_, rng| rng.random_range(0.03..0.12),
            ..BENCHMARK
        },
    ),
    benchmark(
        "empty-table",
        "no ball, five things with straight edges",
        EMPTY,
    ),
    benchmark(
        "noisy-empty",
        "no ball, five things, noise of 10 to 40 gray levels",
        BenchmarkRecipe {
            noise: Some((10.0, 40.0)),
            ..EMPTY
        },
    ),
    benchmark(
        "distractors-noise-10",
        "five distractors and noise of 10 gray levels",
        noisy(10.0, DISTRACTORS),
    ),
    benchmark(
        "distractors-noise-25",
        "five distractors and noise of 25 gray levels",
        noisy(25.0, DISTRACTORS),
    ),
    benchmark(
        "textured",
        "four balls that differ from the table, on strong grain among forty things",
        BenchmarkRecipe {
            balls: 4,
            distractors: 40,
            grain: (0.8, 1.0),
            albedo: other_than,
            ..BENCHMARK
        },
    ),
];

impl Recipe {
    /// Returns the recipes that show the arm at work.
    pub fn cell() -> &'static [Self] {
        &CELL_RECIPES
    }

    /// Returns the recipes of one difficulty for a circle detector each.
    pub fn benchmark() -> &'static [Self] {
        &BENCHMARK_RECIPES
    }

    /// Returns the recipe called `name`.
    ///
    /// # Errors
    /// [`QuantityError::Name`] lists the names there are.
    pub fn named(name: &str) -> Result<&'static Self, QuantityError> {
        let all = || CELL_RECIPES.iter().chain(&BENCHMARK_RECIPES);
        let found = all().find(|recipe| recipe.name == name);
        found.ok_or_else(|| QuantityError::Name {
            name: name.to_owned(),
            known: all().map(|r| r.name).collect::<Vec<_>>().join(", "),
        })
    }

    /// Returns the name.
    pub fn name(&self) -> &'static str {
        self.name
    }

    /// Returns a line that describes the frames.
    pub fn summary(&self) -> &'static str {
        self.summary
    }

    /// Draws a scene and the snapshot to be taken of it, `size` pixels wide and high.
    ///
    /// # Errors
    /// [`QuantityError`] for a frame without pixels, or one larger than [`Camera::LARGEST_SIDE`].
    pub fn draw(
        &self,
        size: (u32, u32),
        rng: &mut dyn Rng,
    ) -> Result<(Renderer, Snapshot), QuantityError> {
        match &self.kind {
            Kind::Cell(recipe) => {
                let scene = recipe.scene(rng);
                let renderer = Renderer::new(&scene, rng.random());
                Ok((renderer, recipe.view.snapshot(size, rng)?))
            }
            Kind::Benchmark(recipe) => {
                let (scene, snapshot) = recipe.draw(size, rng)?;
                Ok((Renderer::new(&scene, rng.random()), snapshot))
            }
        }
    }

    /// Draws another snapshot of a scene that [`Recipe::draw`] drew; `None` for a benchmark recipe,
    /// whose scenes are made for one snapshot.
    ///
    /// # Errors
    /// Those of [`Recipe::draw`].
    pub fn draw_again(
        &self,
        size: (u32, u32),
        rng: &mut dyn Rng,
    ) -> Result<Option<Snapshot>, QuantityError> {
        match &self.kind {
            Kind::Cell(recipe) => recipe.view.snapshot(size, rng).map(Some),
            Kind::Benchmark(_) => Ok(None),
        }
    }
}

impl CellRecipe {
    /// Draws a scene: lamps, table, ball's surface, things all over the workspace.
    fn scene(&self, rng: &mut dyn Rng) -> Scene {
        let mut scene = Scene {
            lights: lamps(1.1, rng),
            ambient: rng.random_range(0.15..0.30),
            table: Appearance {
                albedo: rng.random_range(0.25..0.50),
                texture: rng.random_range(0.35..0.7),
                gloss: 0.0,
            },
            ball: Appearance {
                albedo: rng.random_range(0.70..0.90),
                texture: 0.0,
                gloss: rng.random_range(0.05..0.4),
            },
            things: Vec::new(),
            occluders: Vec::new(),
            sensor: Sensor {
                gamma: if rng.random_bool(0.3) { 2.2 } else { 1.0 },
                ..Sensor::default()
            },
        };
        scene.things = things(self.things, self.tall, rng);
        (self.change)(&mut scene, rng);
        scene
    }
}

impl BenchmarkRecipe {
    fn draw(
        &self,
        size: (u32, u32),
        rng: &mut dyn Rng,
    ) -> Result<(Scene, Snapshot), QuantityError> {
        let mut stage = Stage::new(Camera::paper().resized(size.0, size.1)?, rng);
        stage.put_balls(self.balls, self.radii, rng);
        let mut scene = self.surfaces(rng);
        scene.things = stage.other_balls(scene.table.albedo, rng);
        stage.put_distractors(self.distractors, &mut scene.things, rng);
        if self.hidden > 0.0 {
            scene.occluders.extend(stage.cover(self.hidden, rng));
        }
        let (mut speed, mut shot) = (Default::default(), Shot::still());
        if let Some((least, most)) = self.motion {
            shot = Shot {
                exposure: 0.010,
                moments: 8,
                interlace: None,
            };
            speed = stage.speed(rng.random_range(least..most), shot.exposure, rng);
        }
        let snapshot = Snapshot {
            cell: stage.cell,
            joints: stage.joints,
            speed,
            shot,
        };
        Ok((scene, snapshot))
    }

    /// Draws lamps, table, the ball's surface and the sensor.
    fn surfaces(&self, rng: &mut dyn Rng) -> Scene {
        let table = Appearance {
            albedo: rng.random_range(0.30..0.50),
            texture: drawn(self.grain, rng),
            gloss: 0.0,
        };
        let albedo = (self.albedo)(table.albedo, rng);
        let mut sensor = Sensor::default();
        if let Some(noise) = self.noise {
            (sensor.read_noise, sensor.shot_noise) = (drawn(noise, rng), 0.0);
        }
        Scene {
            lights: lamps(0.6, rng),
            ambient: rng.random_range(0.20..0.30),
            table,
            ball: Appearance {
                albedo,
                texture: 0.0,
                gloss: rng.random_range(0.05..0.3),
            },
            things: Vec::new(),
            occluders: Vec::new(),
            sensor,
        }
    }
}

/// Draws from a range; one without width draws nothing.
fn drawn((least, most): (f64, f64), rng: &mut dyn Rng) -> f64 {
    if least < most {
        rng.random_range(least..most)
    } else {
        least
    }
}
