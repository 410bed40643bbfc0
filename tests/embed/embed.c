// embed THERMAL ROD [NAME=VALUE ...]: loads both FMUs, unpacked into these folders, steps them through 30 s of 0, 1.5
// and 3 V and prints time [s], T[1..3] [K], tip.p[1..3] [m]. The rest sets parameters of the rod. Yours to copy.
//   cc -I HEADERS embed.c -o embed -ldl, HEADERS being a folder of FMI's headers, such as the package fmpy's c-code.
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi2FunctionTypes.h"
#ifdef _WIN32
#include <windows.h>
#define BINARY "%s/binaries/win64/%s.dll"
#define LOAD(path) ((void*)LoadLibraryA(path))
#define FIND(library, name) ((void*)GetProcAddress(library, name))
#else
#include <dlfcn.h>
#define BINARY "%s/binaries/linux64/%s.so"
#define LOAD(path) dlopen(path, RTLD_NOW | RTLD_LOCAL)
#define FIND(library, name) dlsym(library, name)
#endif

typedef struct {
  char xml[1 << 19];
  void* library;
  fmi2Component instance;
} Fmu;

#define FUNCTION(fmu, name) ((name##TYPE*)FIND((fmu)->library, #name))
#define CALL(fmu, name, ...) need(FUNCTION(fmu, name)((fmu)->instance, ##__VA_ARGS__) <= fmi2Warning, #name)

static void need(int holds, const char* what) {
  if (!holds) fprintf(stderr, "failed: %s\n", what), exit(1);
}

static void show(fmi2ComponentEnvironment host, fmi2String name, fmi2Status status, fmi2String category,
                 fmi2String text, ...) {
  (void)host, (void)status;
  va_list values;
  va_start(values, text);
  fprintf(stderr, "%s, %s: ", name, category), vfprintf(stderr, text, values), fputc('\n', stderr);
  va_end(values);
}

/// Value references by name: modelDescription.xml has each right behind the name.
static fmi2ValueReference reference(const Fmu* fmu, const char* name) {
  char start[99];
  snprintf(start, sizeof start, "<ScalarVariable name=\"%s\" valueReference=\"", name);
  const char* entry = strstr(fmu->xml, start);
  need(entry != NULL, name);
  return (fmi2ValueReference)atoi(entry + strlen(start));
}

static Fmu* load(const char* folder, const char* name) {
  static const fmi2CallbackFunctions callbacks = {show, calloc, free, NULL, NULL};
  char path[999], guid[64] = "";
  Fmu* fmu = calloc(1, sizeof *fmu);
  snprintf(path, sizeof path, "%s/modelDescription.xml", folder);
  FILE* file = fopen(path, "rb");
  need(file && fread(fmu->xml, 1, sizeof fmu->xml - 1, file), path);
  fclose(file);
  need(sscanf(strstr(fmu->xml, "guid="), "guid=\"%63[^\"]", guid), "guid");
  snprintf(path, sizeof path, BINARY, folder, name);
  need((fmu->library = LOAD(path)) != NULL, path);
  fmu->instance = FUNCTION(fmu, fmi2Instantiate)(name, fmi2CoSimulation, guid, "", &callbacks, fmi2False, fmi2True);
  need(fmu->instance != NULL, "fmi2Instantiate");
  return fmu;
}

int main(int count, char** arguments) {
  need(count >= 3, "usage: embed THERMAL ROD [NAME=VALUE ...]");
  Fmu *thermal = load(arguments[1], "thermal"), *rod = load(arguments[2], "rod");
  fmi2ValueReference V[3], heat[3], T[3], tip[3], at = reference(rod, "dynamic");
  for (int i = 0; i < 3; ++i) {
    char name[9];
    snprintf(name, sizeof name, "V[%d]", i + 1), V[i] = reference(thermal, name);
    snprintf(name, sizeof name, "T[%d]", i + 1), heat[i] = reference(thermal, name), T[i] = reference(rod, name);
    snprintf(name, sizeof name, "tip.p[%d]", i + 1), tip[i] = reference(rod, name);
  }
  const fmi2Boolean no = fmi2False;
  CALL(thermal, fmi2SetReal, V, 3, (const double[]){0.0, 1.5, 3.0});
  CALL(rod, fmi2SetBoolean, &at, 1, &no);  // heating is slow: the shape goes through equilibria
  for (int i = 3; i < count; ++i) {
    const double value = atof(strchr(arguments[i], '=') + 1);
    at = reference(rod, strtok(arguments[i], "="));
    CALL(rod, fmi2SetReal, &at, 1, &value);
  }
  CALL(thermal, fmi2EnterInitializationMode);
  CALL(thermal, fmi2ExitInitializationMode);
  CALL(rod, fmi2EnterInitializationMode);
  CALL(rod, fmi2ExitInitializationMode);
  for (int i = 0; i < 300; ++i) {
    const double t = 0.1 * i, h = 0.1;
    double k[3], p[3];
    CALL(thermal, fmi2DoStep, t, h, fmi2True);
    CALL(thermal, fmi2GetReal, heat, 3, k);
    CALL(rod, fmi2SetReal, T, 3, k);
    CALL(rod, fmi2DoStep, t, h, fmi2True);
    CALL(rod, fmi2GetReal, tip, 3, p);
    printf("%.1f %.17g %.17g %.17g %.17g %.17g %.17g\n", t + h, k[0], k[1], k[2], p[0], p[1], p[2]);
  }
  FUNCTION(thermal, fmi2FreeInstance)(thermal->instance);
  FUNCTION(rod, fmi2FreeInstance)(rod->instance);
}
