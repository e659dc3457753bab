// What OpenNI2 and its drivers leak themselves, so that LeakSanitizer shows ours: lists of sensors asked for, names of
// devices, the players of .oni files, 20 KB for each file opened.
extern "C" const char* __lsan_default_suppressions() {
  return "leak:libOpenNI2.so\nleak:libOniFile.so\nleak:libPS1080.so\nleak:libPSLink.so\nleak:libDummyDevice.so\n";
}
