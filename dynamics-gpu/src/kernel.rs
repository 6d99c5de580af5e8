//! The text of a kernel: the model's programs and the method that moves its runs.
//!
//! It is C99 and C++ alike. A compiler for the processor makes a function of it, which tests compare with the
//! lanes of the processor, bit by bit. With [`CUDA`] before and [`LAUNCHED`] behind it is a kernel.

use dynamics_export::{CExport, ExportC as _, ExportError};
use dynamics_runtime::integrate::{LANE_METHOD, LaneMethod};
use dynamics_runtime::model::{PrintedInC, PrintedInWgsl, SimulationModel};

/// The method, with gaps `<<..>>` for sizes, tables and calls. `%%` stands for the model's prefix in
/// capitals.
const METHOD: &str = include_str!("side_by_side.c");

/// What a kernel needs before the text: words that C has and CUDA has not.
pub(crate) const CUDA: &str = "\
#define restrict __restrict__
#define FLT_EVAL_METHOD 0
#define DBL_MANT_DIG 53
#ifndef NAN
#define NAN __longlong_as_double(0x7ff8000000000000LL)
#endif
#ifndef INFINITY
#define INFINITY __longlong_as_double(0x7ff0000000000000LL)
#endif
";

/// The kernel itself: a thread for each run. `$` stands for the model's prefix.
const LAUNCHED: &str = "
extern \"C\" __global__ void $_kernel(const double *given, double *moving, int *outcomes, size_t runs,
  int attempts)
{
  const size_t run = (size_t)blockIdx.x*(size_t)blockDim.x + (size_t)threadIdx.x;
  if ((run < runs) && (outcomes[run] == 0)) {
    outcomes[run] = $_side_by_side(given, moving, runs, run, attempts);
  }
}
";

/// Why a model has no kernel.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum KernelError {
    /// Its runs are projected onto constraints, which kernels do not do.
    #[error("{model} has constraints, which kernels do not hold: its runs are made by the processor")]
    Constraints {
        /// Name of the model.
        model: &'static str,
    },
    /// It cannot be written in WGSL.
    #[error("{model} has no kernel in WGSL: {reason}")]
    Wgsl {
        /// Name of the model.
        model: &'static str,
        /// What stands against it.
        reason: &'static str,
    },
    /// It cannot be written in C.
    #[error(transparent)]
    Export(#[from] ExportError),
}

/// The name of the kernel of a model.
#[cfg(feature = "cuda")]
pub(crate) fn name<M: PrintedInC>() -> String {
    format!("{}_kernel", M::C.name)
}

/// A function in C99 that moves a run of a [`Batch`](dynamics_runtime::simulate::Batch), with all that it
/// needs but for headers:
///
/// ```c
/// int NAME_side_by_side(const double *given, double *moving, size_t runs, size_t run, int attempts);
/// ```
///
/// It makes so many attempts at most, and returns the run's outcome: 0 where it goes on. NAME is the struct's
/// name in small letters. Headers that it needs are `<math.h>`, `<float.h>` and `<stddef.h>`.
///
/// # Errors
/// The model has constraints; it cannot be written in C.
pub fn side_by_side_in_c<M: SimulationModel + PrintedInC>(model: &M) -> Result<String, KernelError> {
    if !M::ROWS.is_empty() {
        return Err(KernelError::Constraints { model: M::NAME });
    }
    let export = model.in_c().without_example();
    // A model that takes the sines of the platform in Rust takes them here, too.
    let export: CExport<'_, M> = if M::C.accurate { export } else { export.library_sines() };
    Ok(format!("{}\n{}", export.text()?, method::<M>(&LANE_METHOD)))
}

/// A kernel in CUDA, with [`side_by_side_in_c`] for each thread.
///
/// # Errors
/// The model has constraints; it cannot be written in C.
pub fn kernel_in_cuda<M: SimulationModel + PrintedInC>(model: &M) -> Result<String, KernelError> {
    let text = side_by_side_in_c(model)?;
    Ok(format!("{CUDA}{text}{}", LAUNCHED.replace('$', M::C.name)))
}

/// The method in WGSL, with gaps as in [`METHOD`].
const METHOD_IN_WGSL: &str = include_str!("side_by_side.wgsl");

/// A kernel in WGSL: an entry point `advance`, a thread for each run. It computes in single precision.
///
/// # Errors
/// What cannot be written in WGSL.
pub fn kernel_in_wgsl<M: SimulationModel + PrintedInWgsl>() -> Result<String, KernelError> {
    if let Some(reason) = M::WGSL.obstacles.first() {
        return Err(KernelError::Wgsl { model: M::NAME, reason });
    }
    let method = &LANE_METHOD;
    let (n, p, w) = (M::COORDINATES.len(), M::PARAMETERS.len(), M::INPUTS.len());
    let last = method.rows.len() - 1;
    let slopes: String = (0..=last).map(|stage| format!("  var k{stage}: Phase;\n")).collect();
    let mut stages = String::new();
    for (stage, row) in method.rows.iter().enumerate() {
        if stage == last {
            stages.push_str("    before = place;\n");
        }
        stages.push_str(&sum_in_wgsl(row));
        let node = single(method.nodes[stage]);
        stages.push_str(&format!(
            "    move_by(h, &sum, &y, &place);\n    exists = stage(p, k, w, t + {node}*h, &place, &k{stage}) && exists;\n"
        ));
    }
    let border = method.stability_border * method.stability_border;
    let gaps = [
        ("<<N>>", n.to_string()),
        ("<<P>>", p.to_string()),
        ("<<W>>", w.to_string()),
        ("<<P1>>", p.max(1).to_string()),
        ("<<W1>>", w.max(1).to_string()),
        ("<<K1>>", M::WGSL.constants.max(1).to_string()),
        ("<<PROGRAMS>>", M::WGSL.programs.to_owned()),
        ("<<SLOPES>>", slopes),
        ("<<STAGES>>", stages),
        ("<<ERRORS>>", sum_in_wgsl(method.errors)),
        ("<<ENDS>>", sum_in_wgsl(method.weights)),
        ("<<BEFORE>>", (last - 1).to_string()),
        ("<<LAST>>", last.to_string()),
        ("<<SHARE>>", single(1.0 / (2 * n) as f64)),
        ("<<STRETCHED>>", single(1.0 + method.last_step_stretch)),
        ("<<SAFETY>>", single(method.safety)),
        ("<<SHRINK>>", single(method.shrink)),
        ("<<GROW>>", single(method.grow)),
        ("<<FAILED>>", single(method.failed_step_part)),
        ("<<CUT>>", single(method.cut_short_part)),
        ("<<BORDER_2>>", single(border)),
        ("<<BORDER_4>>", single(border * border)),
        ("<<RESOLVED>>", single(method.resolved_step_part / f64::EPSILON * f64::from(f32::EPSILON))),
        ("<<REJECTIONS>>", single(method.max_rejections)),
        ("<<STIFF>>", single(method.stiff_steps)),
    ];
    Ok(gaps.iter().fold(METHOD_IN_WGSL.to_owned(), |text, (gap, with)| text.replace(gap, with)))
}

/// A sum of slopes in WGSL.
fn sum_in_wgsl(row: &[(usize, f64)]) -> String {
    let parts = row.iter().map(|(stage, weight)| format!("    add({}, &k{stage}, &sum);\n", single(*weight)));
    std::iter::once("    clear(&sum);\n".to_owned()).chain(parts).collect()
}

/// A number in single precision.
fn single(x: f64) -> String {
    format!("{:?}f", x as f32)
}

/// The method for a model.
fn method<M: SimulationModel + PrintedInC>(method: &LaneMethod) -> String {
    let name = M::C.name;
    let (n, p, w) = (M::COORDINATES.len(), M::PARAMETERS.len(), M::INPUTS.len());
    let sizes = format!("#define N {n}\n#define P {p}\n#define W {w}\n");
    let inputs = if w > 0 { ", w" } else { "" };
    let last = method.rows.len() - 1;
    let border = method.stability_border * method.stability_border;
    let gaps = [
        ("<<SIZES>>", sizes),
        ("<<CALL>>", format!("{name}_accelerations(p, k, t, q, u{inputs}, a)")),
        (
            "<<HEAD>>",
            format!(
                "static int {name}_side_by_side(const double *given, double *moving, size_t runs, size_t run, int attempts)"
            ),
        ),
        ("<<NAME>>", name.to_owned()),
        ("<<CONSTANTS>>", M::C.constants.to_string()),
        ("<<STAGES>>", stages(method)),
        ("<<ERRORS>>", sum(method.errors)),
        ("<<ENDS>>", sum(method.weights)),
        ("<<BEFORE>>", (last - 1).to_string()),
        ("<<LAST>>", last.to_string()),
        ("<<SHARE>>", number(1.0 / (2 * n) as f64)),
        ("<<STRETCHED>>", number(1.0 + method.last_step_stretch)),
        ("<<SAFETY>>", number(method.safety)),
        ("<<SHRINK>>", number(method.shrink)),
        ("<<GROW>>", number(method.grow)),
        ("<<FAILED>>", number(method.failed_step_part)),
        ("<<CUT>>", number(method.cut_short_part)),
        ("<<BORDER_2>>", number(border)),
        ("<<BORDER_4>>", number(border * border)),
        ("<<RESOLVED>>", number(method.resolved_step_part)),
        ("<<REJECTIONS>>", number(method.max_rejections)),
        ("<<STIFF>>", number(method.stiff_steps)),
        ("%%", name.to_uppercase()),
    ];
    gaps.iter().fold(METHOD.to_owned(), |text, (gap, with)| text.replace(gap, with))
}

/// A number that C reads as the same one.
fn number(x: f64) -> String {
    format!("{x:?}")
}

/// The stages of a step. Of the last two, which are at the same time, the states are kept for the estimate of
/// the stiffness.
fn stages(method: &LaneMethod) -> String {
    let last = method.rows.len() - 1;
    let mut text = String::new();
    for (stage, row) in method.rows.iter().enumerate() {
        text.push_str(&format!("    double kq{stage}[N], ku{stage}[N];\n"));
        if stage == last {
            text.push_str(
                "    for (i = 0; i < N; i++) {\n      before_q[i] = at_q[i];\n      before_u[i] = at_u[i];\n    }\n",
            );
        }
        text.push_str(&sum(row));
        text.push_str("    move(h, of_q, of_u, q, u, at_q, at_u);\n");
        let node = number(method.nodes[stage]);
        text.push_str(&format!("    stage(p, k, t + {node}*h, at_q, at_u, w, kq{stage}, ku{stage});\n"));
    }
    text
}

/// A sum of slopes.
fn sum(row: &[(usize, f64)]) -> String {
    let mut text = "    clear(of_q, of_u);\n".to_owned();
    for (stage, weight) in row {
        text.push_str(&format!("    add({}, kq{stage}, ku{stage}, of_q, of_u);\n", number(*weight)));
    }
    text
}
