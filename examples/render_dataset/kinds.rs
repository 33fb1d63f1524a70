//! Options of `render_dataset`: kinds of frames, sizes, shares.

use std::str::FromStr;

use pipeline_sim::Recipe;
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;

/// A kind of frame.
#[derive(Clone, Copy)]
pub(crate) struct Kind {
    pub(crate) recipe: &'static Recipe,
    /// Smallest radius in the truth, pixels of a frame 768 wide.
    pub(crate) least_radius: f64,
}

/// One or several kinds, as given on the command line.
#[derive(Clone)]
pub(crate) struct Kinds(pub(crate) Vec<Kind>);

impl FromStr for Kinds {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        let list = |recipes: &'static [Recipe], least_radius| -> Vec<Kind> {
            let kind = |recipe| Kind {
                recipe,
                least_radius,
            };
            recipes.iter().map(kind).collect()
        };
        let (mut kinds, benchmark) = (list(Recipe::cell(), 5.0), list(Recipe::benchmark(), 0.0));
        match name {
            "cell" => {}
            "benchmark" => kinds = benchmark,
            _ => {
                Recipe::named(name)
                    .map_err(|error| format!("{error} (and all of `cell` or `benchmark`)"))?;
                kinds.extend(benchmark);
                kinds.retain(|kind| kind.recipe.name() == name);
            }
        }
        Ok(Self(kinds))
    }
}

impl Kind {
    /// Returns a generator that no other kind and no other seed shares.
    pub(crate) fn generator(self, seed: u64) -> Xoshiro256PlusPlus {
        // FNV-1a over the name and the seed.
        let name = self.recipe.name().bytes();
        let hash = name
            .chain(seed.to_le_bytes())
            .fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| {
                (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
            });
        Xoshiro256PlusPlus::seed_from_u64(hash)
    }
}

/// Returns the first kind that is named twice: its files would be overwritten.
pub(crate) fn repeated(kinds: &[Kind]) -> Option<String> {
    let names: Vec<&str> = kinds.iter().map(|kind| kind.recipe.name()).collect();
    let again = (1..names.len()).find(|i| names[..*i].contains(&names[*i]));
    again.map(|i| names[i].to_owned())
}

/// Parses a share from 0 to 1.
pub(crate) fn share(text: &str) -> Result<f64, String> {
    let number: Option<f64> = text
        .parse()
        .ok()
        .filter(|share| (0.0..=1.0).contains(share));
    number.ok_or_else(|| format!("{text} is not a share from 0 to 1"))
}

/// Parses width and height, as in `768x576`.
pub(crate) fn size(text: &str) -> Result<(u32, u32), String> {
    let number = |part: &str| part.parse().ok().filter(|n| (16..=8192).contains(n));
    text.split_once('x')
        .and_then(|(width, height)| Some((number(width)?, number(height)?)))
        .ok_or_else(|| format!("{text} is not a size such as 768x576, from 16 to 8192 pixels each"))
}
