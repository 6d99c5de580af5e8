//! Random samples of the inputs.

use std::sync::Arc;

use super::correlation::{Correlated, quoted};
use super::distribution::{Distribution, standard_normal};
use super::latin_hypercube::{LatinHypercube, unit};
use super::sobol::{DIGITS, MAX_DIMENSIONS, Sobol};
use super::{InputError, Inputs};
use dynamics_analysis::shared::RandomNumbers;

/// Samples of inputs with given distributions.
///
/// | points | error of a mean of n runs | when |
/// |---|---|---|
/// | [`Samples::sobol`] | near 1/n for smooth results, at best for n a power of 2 | the usual choice |
/// | [`Samples::latin_hypercube`] | 1/√n of what is not a sum over inputs | few runs, many inputs |
/// | [`Samples::random`] | 1/√n | standard errors and quantiles that need independent runs |
///
/// ```
/// # mod dynamics { pub use dynamics_ensembles as ensembles; }
/// use dynamics::ensembles::{Inputs, Samples};
///
/// let samples = Samples::sobol(1024)
///     .uniform("theta1", 0.0, 1.0)
///     .normal("l1", 1.0, 0.01)
///     .correlated(["m1", "m2"], [1.0, 2.0], [[0.01, 0.005], [0.005, 0.01]]);
/// assert_eq!(samples.names(), ["theta1", "l1", "m1", "m2"]);
/// assert_eq!(samples.count(), 1024);
/// ```
#[derive(Clone, Debug)]
#[must_use]
pub struct Samples {
    kind: Kind,
    count: usize,
    seed: Option<u64>,
    names: Vec<String>,
    groups: Vec<Group>,
    points: UnitPoints,
}

/// How points are chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    Sobol,
    LatinHypercube,
    Random,
}

/// Inputs that belong together.
#[derive(Clone, Debug)]
enum Group {
    One(Distribution),
    Correlated(Correlated, usize),
}

impl Group {
    fn len(&self) -> usize {
        match self {
            Self::One(_) => 1,
            Self::Correlated(_, len) => *len,
        }
    }
}

/// Points of the unit cube.
#[derive(Clone, Debug)]
pub(super) enum UnitPoints {
    Sobol(Sobol),
    LatinHypercube(LatinHypercube),
    /// Seed and dimensions.
    Random(u64, usize),
}

impl UnitPoints {
    /// The coordinate of a point, between 0 and 1, neither of them.
    pub(super) fn at(&self, index: usize, dimension: usize) -> f64 {
        match self {
            Self::Sobol(sobol) => sobol.at(index, dimension),
            Self::LatinHypercube(cube) => cube.at(index, dimension),
            Self::Random(seed, dimensions) => unit(*seed, (index * dimensions + dimension) as u64),
        }
    }
}

impl Samples {
    fn new(kind: Kind, count: usize, seed: Option<u64>) -> Self {
        let points = UnitPoints::Random(0, 0);
        Self { kind, count, seed, names: Vec::new(), groups: Vec::new(), points }
    }

    /// The first points of the Sobol sequence with the direction numbers of Joe and Kuo, in up to 256
    /// dimensions, scrambled with the seed 0. The count should be a power of 2.
    pub fn sobol(count: usize) -> Self {
        Self::new(Kind::Sobol, count, Some(0))
    }

    /// A Latin hypercube: each input has one value in each of `count` parts of equal probability. Another
    /// seed gives another hypercube.
    pub fn latin_hypercube(count: usize, seed: u64) -> Self {
        Self::new(Kind::LatinHypercube, count, Some(seed))
    }

    /// Independent random points. Another seed gives others.
    pub fn random(count: usize, seed: u64) -> Self {
        Self::new(Kind::Random, count, Some(seed))
    }

    /// Another seed. Of Sobol sequences it is that of a random scrambling (Owen): points stay as even, means
    /// have no bias, and their scatter over several seeds shows their error.
    pub fn seed(mut self, seed: u64) -> Self {
        self.seed = Some(seed);
        self.completed()
    }

    /// The Sobol sequence as it is published, without scrambling. Its first point is the lower bound of all
    /// inputs: far outside for those that are normally distributed. Other samples get the seed 0.
    pub fn unscrambled(mut self) -> Self {
        self.seed = None;
        self.completed()
    }

    /// An input that is evenly distributed between two bounds.
    pub fn uniform(self, name: &str, low: f64, high: f64) -> Self {
        self.one(name, Distribution::Uniform { low, high })
    }

    /// An input whose logarithm is evenly distributed, between two bounds above 0.
    pub fn log_uniform(self, name: &str, low: f64, high: f64) -> Self {
        self.one(name, Distribution::LogUniform { low, high })
    }

    /// A normally distributed input.
    pub fn normal(self, name: &str, mean: f64, deviation: f64) -> Self {
        self.one(name, Distribution::Normal { mean, deviation })
    }

    /// An input with any distribution, by its quantiles: `quantile(p)` is the value below which it lies with
    /// probability p, between 0 and 1.
    pub fn distributed(self, name: &str, quantile: impl Fn(f64) -> f64 + Send + Sync + 'static) -> Self {
        self.one(name, Distribution::Quantiles(Arc::new(quantile)))
    }

    /// Inputs with a joint normal distribution: their means, and their covariance by rows.
    pub fn correlated<N: AsRef<str>, R: AsRef<[f64]>>(
        mut self,
        names: impl IntoIterator<Item = N>,
        mean: impl IntoIterator<Item = f64>,
        covariance: impl IntoIterator<Item = R>,
    ) -> Self {
        let names: Vec<String> = names.into_iter().map(|name| name.as_ref().to_owned()).collect();
        let covariance = covariance.into_iter().map(|row| row.as_ref().to_vec()).collect();
        let joint = Correlated::new(&names, mean.into_iter().collect(), covariance);
        self.groups.push(Group::Correlated(joint, names.len()));
        self.names.extend(names);
        self.completed()
    }

    fn one(mut self, name: &str, distribution: Distribution) -> Self {
        self.names.push(name.into());
        self.groups.push(Group::One(distribution));
        self.completed()
    }

    /// With points in as many dimensions as there are inputs.
    fn completed(mut self) -> Self {
        self.points = self.unit_points(self.names.len());
        self
    }

    /// Points in some dimensions.
    pub(super) fn unit_points(&self, dimensions: usize) -> UnitPoints {
        let seed = self.seed.unwrap_or(0);
        match self.kind {
            Kind::Sobol => UnitPoints::Sobol(Sobol::new(dimensions, self.seed)),
            Kind::LatinHypercube => {
                UnitPoints::LatinHypercube(LatinHypercube::new(self.count, dimensions, seed))
            }
            // Seeds that are close give sequences that are not.
            Kind::Random => UnitPoints::Random(RandomNumbers(seed).next(), dimensions),
        }
    }

    /// The values of a point of the unit cube, in place.
    pub(super) fn values_at(&self, point: &mut [f64]) {
        let mut rest = point;
        for group in &self.groups {
            let (own, others) = rest.split_at_mut(group.len());
            match group {
                Group::One(distribution) => own[0] = distribution.quantile(own[0]),
                Group::Correlated(joint, _) => {
                    own.iter_mut().for_each(|p| *p = standard_normal(*p));
                    joint.mix(own);
                }
            }
            rest = others;
        }
    }

    /// Checks all but the number of dimensions.
    pub(super) fn check_inputs(&self, dimensions: usize) -> Result<(), InputError> {
        if self.names.is_empty() {
            return Err(InputError::NothingVaries);
        }
        if self.count == 0 {
            return Err(InputError::TooFew { least: 1 });
        }
        if self.count as u64 > 1 << DIGITS {
            return Err(InputError::TooMany);
        }
        if self.kind == Kind::Sobol && dimensions > MAX_DIMENSIONS {
            return Err(InputError::Dimensions { most: MAX_DIMENSIONS, needed: dimensions });
        }
        let mut names = self.names.as_slice();
        for group in &self.groups {
            let (own, others) = names.split_at(group.len());
            match group {
                Group::One(distribution) => distribution.check(&own[0])?,
                Group::Correlated(joint, _) => joint.check(own)?,
            }
            names = others;
        }
        Ok(())
    }

    /// The names of inputs that depend on each other.
    pub(super) fn correlated_names(&self) -> Option<String> {
        let mut names = self.names.as_slice();
        for group in &self.groups {
            let (own, others) = names.split_at(group.len());
            if matches!(group, Group::Correlated(..)) {
                return Some(quoted(own));
            }
            names = others;
        }
        None
    }

    /// How the points are chosen, in words.
    pub(super) fn points_in_words(&self) -> String {
        match (self.kind, self.seed) {
            (Kind::Sobol, None) => "Sobol sequence".into(),
            (Kind::Sobol, Some(seed)) => format!("Sobol sequence, scrambled with seed {seed}"),
            (Kind::LatinHypercube, seed) => {
                format!("Latin hypercube of {} with seed {}", self.count, seed.unwrap_or(0))
            }
            (Kind::Random, seed) => format!("random with seed {}", seed.unwrap_or(0)),
        }
    }

    /// The inputs, in words.
    pub(super) fn inputs_in_words(&self) -> Vec<(String, String)> {
        let of_group = |group: &Group| match group {
            Group::One(distribution) => vec![distribution.in_words()],
            Group::Correlated(joint, len) => (0..*len).map(|row| joint.in_words(row)).collect(),
        };
        let texts = self.groups.iter().flat_map(of_group);
        self.names.iter().zip(texts).map(|(name, text)| (format!("varies {name}"), text)).collect()
    }
}

impl Inputs for Samples {
    fn names(&self) -> Vec<String> {
        self.names.clone()
    }

    fn count(&self) -> usize {
        self.count
    }

    fn point(&self, run: usize, values: &mut [f64]) {
        values.iter_mut().enumerate().for_each(|(dimension, x)| *x = self.points.at(run, dimension));
        self.values_at(values);
    }

    fn plan(&self) -> Vec<(String, String)> {
        let mut plan = vec![("inputs".into(), self.points_in_words())];
        plan.extend(self.inputs_in_words());
        plan
    }

    fn check(&self) -> Result<(), InputError> {
        self.check_inputs(self.names.len())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn columns(samples: &Samples) -> Vec<Vec<f64>> {
        let mut point = vec![0.0; samples.names.len()];
        let mut columns = vec![Vec::new(); point.len()];
        for run in 0..samples.count {
            samples.point(run, &mut point);
            columns.iter_mut().zip(&point).for_each(|(column, x)| column.push(*x));
        }
        columns
    }

    /// Sample means and covariances of all kinds of points are those that were asked for.
    #[test]
    fn correlated_inputs_have_their_covariance() {
        let (mean, covariance) =
            ([1.0, -2.0, 5.0], [[0.04, 0.018, 0.0], [0.018, 0.09, -0.2], [0.0, -0.2, 1.0]]);
        let n = 1 << 14;
        let kinds = [
            (Samples::sobol(n).unscrambled(), 3e-3),
            (Samples::sobol(n).seed(3), 3e-3),
            (Samples::latin_hypercube(n, 4), 4.0 / (n as f64).sqrt()),
            (Samples::random(n, 5), 5.0 / (n as f64).sqrt()),
        ];
        for (samples, bound) in kinds {
            let samples = samples.normal("g", 9.0, 1.0).correlated(["a", "b", "c"], mean, covariance);
            samples.check().unwrap();
            let columns = &columns(&samples)[1..];
            let means: Vec<f64> = columns.iter().map(|x| x.iter().sum::<f64>() / n as f64).collect();
            for i in 0..3 {
                let deviation = f64::sqrt(covariance[i][i]);
                assert!((means[i] - mean[i]).abs() < bound * deviation, "{samples:?} mean {i}");
                for j in 0..3 {
                    let product = |(x, y): (&f64, &f64)| (x - means[i]) * (y - means[j]);
                    let found = columns[i].iter().zip(&columns[j]).map(product).sum::<f64>() / n as f64;
                    let scale = deviation * f64::sqrt(covariance[j][j]);
                    assert!(
                        (found - covariance[i][j]).abs() < 2.0 * bound * scale,
                        "{samples:?} {i} {j}: {found}"
                    );
                }
            }
        }
    }

    #[test]
    fn samples_that_cannot_be_are_refused() {
        let error = |samples: Samples| samples.check().unwrap_err().to_string();
        assert!(error(Samples::sobol(4)).contains("nothing varies"));
        assert!(error(Samples::sobol(0).uniform("a", 0.0, 1.0)).contains("at least 1"));
        let joint = |covariance: [[f64; 2]; 2]| {
            error(Samples::random(4, 0).correlated(["a", "b"], [0.0; 2], covariance))
        };
        assert!(joint([[1.0, 0.5], [0.4, 1.0]]).contains("not symmetric"));
        assert!(joint([[1.0, 2.0], [2.0, 1.0]]).contains("not positive definite"));
        assert!(joint([[1.0, 1.0], [1.0, 1.0]]).contains("`b` has no variance of its own"));
        assert!(joint([[f64::NAN, 0.0], [0.0, 1.0]]).contains("not positive definite"));
        let shape = Samples::random(4, 0).correlated(["a", "b"], [0.0; 3], [[1.0, 0.0], [0.0, 1.0]]);
        assert!(error(shape).contains("give 2 means and 2 rows of 2"));
        let many = (0..257).fold(Samples::sobol(4), |samples, k| samples.uniform(&k.to_string(), 0.0, 1.0));
        assert!(error(many).contains("256 dimensions"));
    }

    #[test]
    fn seeds_differ_and_repeat() {
        let of = |seed| columns(&Samples::random(100, seed).uniform("a", 0.0, 1.0)).remove(0);
        assert_eq!(of(1), of(1));
        assert!(of(1).iter().zip(&of(2)).all(|(a, b)| a != b));
    }
}
