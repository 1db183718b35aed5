//! squirrel-gap.
