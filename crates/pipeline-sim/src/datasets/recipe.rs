//! The table of recipes.

use nalgebra::Vector3;
use rand::{Rng, RngExt};

use crate::datasets::draw::{BenchmarkRecipe, CellRecipe};
use crate::datasets::snapshot::Snapshot;
use crate::datasets::stage::other_than;
use crate::datasets::things::cables;
use crate::error::QuantityError;
use crate::render::renderer::Renderer;
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

const CELL: CellRecipe = CellRecipe {
    things: 70,
    tall: false,
    change: |_, _| {},
    barrel: false,
    empty: false,
    shot: None,
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
            shot: Some(|exposure| Shot {
                exposure: 1.5 * exposure,
                moments: 6,
                interlace: None,
            }),
            ..CELL
        },
    ),
    cell(
        "interlaced",
        "motion in two fields 20 ms apart",
        CellRecipe {
            shot: Some(|exposure| Shot::pal(exposure, 3)),
            ..CELL
        },
    ),
    cell(
        "distorted",
        "things; a lens with barrel distortion",
        CellRecipe {
            barrel: true,
            ..CELL
        },
    ),
    cell(
        "empty",
        "clutter without the ball",
        CellRecipe {
            empty: true,
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
    /// [`QuantityError`] for a frame without pixels, or one larger than
    /// [`Camera::LARGEST_SIDE`](crate::Camera::LARGEST_SIDE).
    pub fn draw(
        &self,
        size: (u32, u32),
        rng: &mut dyn Rng,
    ) -> Result<(Renderer, Snapshot), QuantityError> {
        match &self.kind {
            Kind::Cell(recipe) => {
                let renderer = Renderer::new(&recipe.scene(rng), rng.random());
                Ok((renderer, recipe.snapshot(size, rng)?))
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
            Kind::Cell(recipe) => recipe.snapshot(size, rng).map(Some),
            Kind::Benchmark(_) => Ok(None),
        }
    }
}
