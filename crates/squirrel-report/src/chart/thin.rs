//! Thinning: as many points as the pixels can show, and not one gap less.

/// Thins a curve over a rising x to its first, lowest, highest and last point per pixel column.
///
/// Points in pixels. A gap (a point with NaN) stays a gap; peaks of one sample stay visible.
pub(super) fn columns(points: &[[f64; 2]], column_px: f64) -> Vec<[f64; 2]> {
    let mut kept = Vec::new();
    let mut start = 0;
    while start < points.len() {
        let column = column_of(points[start], column_px);
        let same = |p: &&[f64; 2]| column_of(**p, column_px) == column;
        let end = start + points[start..].iter().take_while(same).count();
        if column.is_none() {
            kept.push([f64::NAN; 2]);
        } else {
            let group = &points[start..end];
            let by_height = |a: &usize, b: &usize| group[*a][1].total_cmp(&group[*b][1]);
            let low = (0..group.len()).min_by(by_height).unwrap_or(0);
            let high = (0..group.len()).max_by(by_height).unwrap_or(0);
            let mut wanted = [0, low, high, group.len() - 1];
            wanted.sort_unstable();
            for (i, &index) in wanted.iter().enumerate() {
                if i == 0 || wanted[i - 1] != index {
                    kept.push(group[index]);
                }
            }
        }
        start = end;
    }
    kept
}

fn column_of(point: [f64; 2], column_px: f64) -> Option<i64> {
    (point[0].is_finite() && point[1].is_finite()).then(|| (point[0] / column_px).floor() as i64)
}

/// Indices of the points of a track that are at least `step` from the last kept one, its ends and
/// its gaps.
pub(super) fn along<const N: usize>(points: &[[f64; N]], step: f64) -> Vec<usize> {
    let gap = |i: usize| points[i].iter().any(|v| !v.is_finite());
    let mut kept: Vec<usize> = Vec::new();
    for i in 0..points.len() {
        let first = kept.last().is_none_or(|&k| gap(k));
        let last = i + 1 == points.len() || gap(i + 1);
        let far = kept.last().is_some_and(|&k| {
            let square: f64 = (0..N).map(|axis| (points[i][axis] - points[k][axis]).powi(2)).sum();
            square >= step * step
        });
        let wanted = if gap(i) { !first } else { first || last || far };
        if wanted {
            kept.push(i);
        }
    }
    kept
}

/// A stretch of a track with one colour: indices of its first and last point, and the step of the
/// colour map.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Run {
    pub(super) first: usize,
    pub(super) last: usize,
    pub(super) bin: Option<usize>,
}

/// Cuts `count` points into stretches of equal colour and at most `longest` segments; neighbours
/// share a point.
///
/// `bin_of(i)` is the colour of the segment from point `i` to `i + 1`, `gap(i)` whether that
/// segment is missing.
pub(super) fn runs(
    count: usize,
    longest: usize,
    bin_of: impl Fn(usize) -> Option<usize>,
    gap: impl Fn(usize) -> bool,
) -> Vec<Run> {
    let mut runs: Vec<Run> = Vec::new();
    for i in 0..count.saturating_sub(1) {
        if gap(i) {
            continue;
        }
        let bin = bin_of(i);
        match runs.last_mut() {
            Some(run) if run.last == i && run.bin == bin && i - run.first < longest => {
                run.last = i + 1;
            }
            _ => runs.push(Run { first: i, last: i + 1, bin }),
        }
    }
    runs
}
