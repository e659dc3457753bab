// What the sanitizers find in OpenNI2 itself, so that they show what is ours.

// Leaks: lists of sensors that were asked for, names of devices, the players of .oni files, 20 KB for each file opened.
extern "C" const char* __lsan_default_suppressions() {
  return "leak:libOpenNI2.so\nleak:libOniFile.so\nleak:libPS1080.so\nleak:libPSLink.so\nleak:libDummyDevice.so\n";
}

// Its events unlock a mutex that they have not locked, and flags of its threads are plain variables.
extern "C" const char* __tsan_default_suppressions() {
  return "mutex:libOpenNI2.so\nmutex:libOniFile.so\nrace:libOpenNI2.so\nrace:libOniFile.so\ndeadlock:libOpenNI2.so\ndeadlock:libOniFile.so\n";
}
