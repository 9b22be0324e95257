define dso_local void @step(ptr %0) #0 {
  call void @mass(ptr %0)
  tail call fastcc i32 @"force"(ptr %0)
}
define internal void @mass(ptr %0) {
  %1 = call double @sin(double 1.0)
}
define i32 @"force"(ptr %0) {
  call void @mass(ptr %0)
}
define void @alone() {
}
