fn main() {
    veduta_compose::Build::new().programs("shaders").write();
}
