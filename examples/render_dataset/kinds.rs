//! What the options of `render_dataset` mean: kinds of frames, sizes, shares.

use std::str::FromStr;

use pipeline_sim::{BenchmarkKind, SceneKind};
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;

/// A kind of frame.
#[derive(Clone, Copy)]
pub(crate) enum Kind {
    Cell(SceneKind),
    Benchmark(BenchmarkKind),
}

/// One or several kinds, as given on the command line.
#[derive(Clone)]
pub(crate) struct Kinds(pub(crate) Vec<Kind>);

impl FromStr for Kinds {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        let all_of_cell = SceneKind::ALL.map(Kind::Cell);
        let all_of_benchmark = BenchmarkKind::ALL.map(Kind::Benchmark);
        Ok(Self(match (name, name.parse(), name.parse()) {
            ("cell", ..) => all_of_cell.to_vec(),
            ("benchmark", ..) => all_of_benchmark.to_vec(),
            (_, Ok(kind), _) => vec![Kind::Cell(kind)],
            (_, _, Ok(kind)) => vec![Kind::Benchmark(kind)],
            (_, Err(of_cell), Err(of_benchmark)) => {
                return Err(format!(
                    "unknown kind; known are cell: {}; benchmark: {}",
                    of_cell.known, of_benchmark.known
                ));
            }
        }))
    }
}

impl Kind {
    pub(crate) fn name(self) -> String {
        match self {
            Self::Cell(kind) => kind.to_string(),
            Self::Benchmark(kind) => kind.to_string(),
        }
    }

    /// A generator that no other kind and no other seed shares.
    pub(crate) fn generator(self, seed: u64) -> Xoshiro256PlusPlus {
        // FNV-1a over the name and the seed.
        let bytes = self
            .name()
            .into_bytes()
            .into_iter()
            .chain(seed.to_le_bytes());
        let hash = bytes.fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| {
            (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
        });
        Xoshiro256PlusPlus::seed_from_u64(hash)
    }
}

/// The first kind that is named twice: its files would be written over.
pub(crate) fn repeated(kinds: &[Kind]) -> Option<String> {
    let names: Vec<String> = kinds.iter().map(|kind| kind.name()).collect();
    let again = (1..names.len()).find(|i| names[..*i].contains(&names[*i]));
    again.map(|i| names[i].clone())
}

/// A share of a whole.
pub(crate) fn share(text: &str) -> Result<f64, String> {
    let number: Option<f64> = text
        .parse()
        .ok()
        .filter(|share| (0.0..=1.0).contains(share));
    number.ok_or_else(|| format!("{text} is not a share from 0 to 1"))
}

/// Width and height, as in `768x576`.
pub(crate) fn size(text: &str) -> Result<(u32, u32), String> {
    let number = |part: &str| part.parse().ok().filter(|n| (16..=8192).contains(n));
    text.split_once('x')
        .and_then(|(width, height)| Some((number(width)?, number(height)?)))
        .ok_or_else(|| format!("{text} is not a size such as 768x576, from 16 to 8192 pixels each"))
}
