//! A JavaScript engine without a browser, with the scripts of live pages in it.

use dynamics::families::portable::PortableFamily;
use dynamics::live::{FamilyLive, Live, OpenLive, motion_script};
use rquickjs::{Context, Runtime};

/// An engine that has a model's programs and all scripts that compute.
pub(crate) struct Engine {
    context: Context,
    _runtime: Runtime,
}

impl Engine {
    pub(crate) fn new<M: OpenLive>(page: &Live<'_, M>) -> Self {
        Self::with_data::<M>(&page.to_json().unwrap())
    }

    /// With the loops of a model with families.
    pub(crate) fn of_family<M: PortableFamily>(page: &FamilyLive<'_, M>) -> Self {
        let [programs, data] = page.to_scripts().unwrap();
        Self::of_texts(&programs, &data)
    }

    /// With the data of a page as JSON, or part of it.
    pub(crate) fn with_data<M: OpenLive>(data: &str) -> Self {
        Self::of_texts(M::JAVASCRIPT, data)
    }

    fn of_texts(programs: &str, data: &str) -> Self {
        let runtime = Runtime::new().unwrap();
        let context = Context::full(&runtime).unwrap();
        let engine = Self { context, _runtime: runtime };
        engine.run::<()>(&motion_script());
        engine
            .run::<()>(&format!("const PROGRAMS = {programs}, MODEL = {{ ...{data}, ...PROGRAMS.model }};",));
        engine
    }

    /// The value of a script; its exception as a panic.
    pub(crate) fn run<T: for<'js> rquickjs::FromJs<'js>>(&self, script: &str) -> T {
        self.context.with(|context| {
            context.eval(script).unwrap_or_else(|error| {
                let exception = context.catch();
                let text = exception.as_exception().map_or_else(|| format!("{error}"), |e| format!("{e}"));
                panic!("{text}")
            })
        })
    }

    /// The results of a program at states that are given as [t], q, u, inputs, modes, q̈ and multipliers.
    pub(crate) fn evaluate(&self, name: &str, parameters: &[f64], given: &[[Vec<f64>; 7]]) -> Vec<Vec<f64>> {
        self.run(&format!(
            "(() => {{
                const of = (list) => Float64Array.from(list);
                const program = PROGRAMS.{name}, p = of({parameters:?});
                const f = MODEL.functions.map(piecewise);
                const k = new Float64Array(program.constants), out = new Float64Array(program.results);
                if (program.hoist) program.hoist(p, f, k);
                return {given:?}.map(([t, q, u, w, m, a, l]) => {{
                    program.run(p, k, f, t[0], of(q), of(u), of(w), of(m), of(a), of(l), out);
                    return Array.from(out);
                }});
            }})()"
        ))
    }
}
