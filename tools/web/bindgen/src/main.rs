//! `patchlock-bindgen MODULE FOLDER`: writes the module, its JavaScript and its types into the folder.

use std::env;

fn main() -> anyhow::Result<()> {
    let mut arguments = env::args_os().skip(1);
    let (Some(module), Some(folder)) = (arguments.next(), arguments.next()) else {
        anyhow::bail!("usage: patchlock-bindgen MODULE FOLDER");
    };
    let mut bindgen = wasm_bindgen_cli_support::Bindgen::new();
    bindgen.input_path(module).out_name("patchlock").web(true)?.typescript(true);
    // Without an argument, the module is read from beside its JavaScript.
    bindgen.omit_default_module_path(false);
    bindgen.remove_name_section(true).remove_producers_section(true).generate(folder)
}
