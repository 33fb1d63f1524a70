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

#[cfg(test)]
mod tests {
    use super::*;
    use rand::Rng as _;

    fn kinds_of(list: &str) -> Vec<Kind> {
        let kinds = list
            .split(',')
            .map(|name| name.parse::<Kinds>().expect("known"));
        kinds.flat_map(|k| k.0).collect()
    }

    #[test]
    fn shares_sizes_and_kinds_that_make_no_sense_are_refused() {
        for text in ["-0.1", "1.01", "nan", "inf", "much"] {
            let refused = share(text).expect_err("no share");
            assert!(refused.contains(text), "{refused}");
        }
        assert_eq!(share("0"), Ok(0.0));
        assert_eq!(share("1"), Ok(1.0));
        for text in ["768", "768x", "15x100", "100x8193", "-1x100"] {
            let refused = size(text).expect_err("no size");
            assert!(refused.contains(text), "{refused}");
        }
        assert_eq!(size("768x576"), Ok((768, 576)));
        assert_eq!(repeated(&kinds_of("cell,benchmark")), None);
        assert_eq!(repeated(&kinds_of("cell,plain")).as_deref(), Some("plain"));
        assert_eq!(
            repeated(&kinds_of("clean,many,clean")).as_deref(),
            Some("clean")
        );
    }

    #[test]
    fn no_two_kinds_and_no_two_seeds_share_their_draws() {
        let mut first: Vec<u64> = kinds_of("cell,benchmark")
            .iter()
            .flat_map(|kind| [1, 2].map(|seed| kind.generator(seed).next_u64()))
            .collect();
        let count = first.len();
        first.sort_unstable();
        first.dedup();
        assert_eq!(first.len(), count);
    }
}
