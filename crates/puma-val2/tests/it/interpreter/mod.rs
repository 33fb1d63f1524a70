//! Every instruction and function, in stored programs and through `DO`.

mod blending;
mod dialects;
mod motions;
mod owners;
mod programs;
mod published;
mod reactions;
mod texts;
