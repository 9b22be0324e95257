/* A stand-in for the libraries of NVIDIA: the driver (libcuda) and NVRTC, on the processor.
 *
 * A program is compiled by the C++ compiler of this machine; its "machine code" is the shared library after eight bytes
 * with the size, and a kernel NAME is the function NAME_host of the library, which runs all threads one after another.
 * Memory of the device is memory of the process. Streams do nothing: each call ends before it returns.
 */
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <dlfcn.h>
#include <filesystem>
#include <fstream>
#include <map>
#include <mutex>
#include <sstream>
#include <string>
#include <vector>

typedef int status;
#define EXPORT extern "C" __attribute__((visibility("default")))

static std::mutex guard;
static std::map<std::string, long long> counted; /* calls by name, for tests */
static std::map<void *, size_t> allocated;
static thread_local int contexts = 0;
static size_t room = size_t(1) << 32;
static void *last_stream = nullptr;

static void count(const char *name)
{
    std::lock_guard<std::mutex> lock(guard);
    ++counted[name];
}

/* -- for tests -------------------------------------------------------------------------------------------------- */

EXPORT long long stand_in_calls(const char *name)
{
    std::lock_guard<std::mutex> lock(guard);
    return counted[name];
}
EXPORT long long stand_in_memory() { std::lock_guard<std::mutex> lock(guard); return (long long)allocated.size(); }
EXPORT long long stand_in_stream() { return (long long)last_stream; }
EXPORT void stand_in_room(long long bytes) { room = bytes; }

/* A graph: launches with copies of their arguments, the last one the number of samples. While it is recorded, calls that
 * wait or take memory fail, as of the driver. */
struct launch {
    void (*kernel)(void **, long long);
    long long threads;
    std::vector<long long> words;
};
static std::vector<launch> graph;
static int recorded_arguments = 0; /* of each launch; 0: no record */

EXPORT void stand_in_record(int arguments) { recorded_arguments = arguments; }
EXPORT long long stand_in_replay()
{
    for (launch &one : graph) {
        std::vector<void *> arguments;
        for (size_t k = 0; k < one.words.size(); k += 3)
            arguments.push_back(&one.words[k]);
        one.kernel(arguments.data(), one.threads);
    }
    return (long long)graph.size();
}

/* -- NVRTC ------------------------------------------------------------------------------------------------------ */

struct program {
    std::string folder, source, log, image;
};

static std::string new_folder()
{
    const char *base = getenv("TMPDIR");
    std::string pattern = std::string(base && *base ? base : "/tmp") + "/eomgen-stand-in-XXXXXX";
    return mkdtemp(pattern.data()) ? pattern : "";
}
static std::string content_of(const std::string &file)
{
    std::stringstream text;
    text << std::ifstream(file, std::ios::binary).rdbuf();
    return text.str();
}

EXPORT const char *nvrtcGetErrorString(status code) { return code == 6 ? "NVRTC_ERROR_COMPILATION" : "NVRTC_ERROR"; }
EXPORT status nvrtcVersion(int *major, int *minor) { *major = 13; *minor = 0; return 0; }
EXPORT status nvrtcCreateProgram(program **made, const char *text, const char *name, int headers,
    const char *const *contents, const char *const *names)
{
    const std::string folder = new_folder();
    *made = new program{folder, folder + "/" + name, "", ""};
    std::ofstream((*made)->source) << text;
    for (int k = 0; k < headers; ++k)
        std::ofstream(folder + "/" + names[k]) << contents[k];
    return 0;
}
EXPORT status nvrtcCompileProgram(program *p, int options, const char *const *given)
{
    std::string command = "c++ -x c++ -std=c++20 -O1 -w -ffp-contract=off -shared -fPIC";
    for (int k = 0; k < options; ++k)
        if (!strncmp(given[k], "-D", 2))
            command += std::string(" '") + given[k] + "'";
    command += " '" + p->source + "' -o '" + p->folder + "/kernels.so' 2> '" + p->folder + "/log.txt'";
    count("nvrtcCompileProgram");
    const int failed = system(command.c_str());
    p->log = content_of(p->folder + "/log.txt");
    const std::string library = content_of(p->folder + "/kernels.so");
    const uint64_t size = library.size();
    p->image = std::string((const char *)&size, 8) + library;
    std::filesystem::remove_all(p->folder);
    return failed ? 6 : 0;
}
EXPORT status nvrtcGetProgramLogSize(program *p, size_t *size) { *size = p->log.size() + 1; return 0; }
EXPORT status nvrtcGetProgramLog(program *p, char *log) { memcpy(log, p->log.c_str(), p->log.size() + 1); return 0; }
EXPORT status nvrtcGetCUBINSize(program *p, size_t *size) { *size = p->image.size(); return 0; }
EXPORT status nvrtcGetCUBIN(program *p, char *image) { memcpy(image, p->image.data(), p->image.size()); return 0; }
EXPORT status nvrtcDestroyProgram(program **p) { delete *p; *p = nullptr; return 0; }

/* -- driver ----------------------------------------------------------------------------------------------------- */

EXPORT status cuGetErrorString(status code, const char **text)
{
    *text = code == 2 ? "out of memory" : code == 100 ? "no CUDA-capable device is detected" : "an error";
    return 0;
}
EXPORT status cuInit(unsigned) { return getenv("STAND_IN_WITHOUT_CARD") ? 100 : 0; }
EXPORT status cuDriverGetVersion(int *version) { *version = 13000; return 0; }
EXPORT status cuDeviceGetCount(int *number) { *number = 1; return 0; }
EXPORT status cuDeviceGet(int *device, int index) { *device = index; return 0; }
EXPORT status cuDeviceGetName(char *name, int size, int) { snprintf(name, size, "stand-in"); return 0; }
EXPORT status cuDeviceGetAttribute(int *value, int which, int)
{
    *value = which == 75 ? 9 : which == 16 ? 4 : 0;
    return 0;
}
EXPORT status cuDevicePrimaryCtxRetain(void **context, int) { *context = &allocated; return 0; }
EXPORT status cuCtxPushCurrent_v2(void *) { ++contexts; return 0; }
EXPORT status cuCtxPopCurrent_v2(void **) { --contexts; return 0; }
EXPORT status cuCtxGetDevice(int *device) { *device = 0; return 0; }
EXPORT status cuCtxSynchronize() { return recorded_arguments ? 900 : contexts ? 0 : 201; }
EXPORT status cuModuleLoadData(void **module, const void *image)
{
    const std::string folder = new_folder(), file = folder + "/kernels.so";
    uint64_t size;
    memcpy(&size, image, 8);
    std::ofstream(file, std::ios::binary).write((const char *)image + 8, (long)size);
    *module = dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
    std::filesystem::remove_all(folder);
    return *module ? contexts ? 0 : 201 : 200;
}
EXPORT status cuModuleGetFunction(void **function, void *module, const char *name)
{
    count(name);
    *function = dlsym(module, (std::string(name) + "_host").c_str());
    return *function ? 0 : 500;
}
EXPORT status cuFuncGetAttribute(int *value, int, void *) { *value = 0; return 0; }
EXPORT status cuLaunchKernel(void *function, unsigned blocks, unsigned, unsigned, unsigned block, unsigned, unsigned,
    unsigned, void *stream, void **arguments, void **)
{
    count("cuLaunchKernel");
    last_stream = stream;
    if (!contexts && getenv("STAND_IN_STRICT"))
        return 201;
    if (recorded_arguments) {
        launch one = { (void (*)(void **, long long))function, (long long)blocks * block, {} };
        for (int k = 0; k < recorded_arguments; ++k)
            one.words.insert(one.words.end(), (long long *)arguments[k],
                (long long *)arguments[k] + (k + 1 < recorded_arguments ? 3 : 1));
        graph.push_back(one);
        return 0;
    }
    ((void (*)(void **, long long))function)(arguments, (long long)blocks * block);
    return 0;
}
EXPORT status cuMemGetInfo_v2(size_t *free, size_t *total) { *free = *total = room; return 0; }
EXPORT status cuMemAlloc_v2(uint64_t *address, size_t size)
{
    if (recorded_arguments || size > room)
        return recorded_arguments ? 900 : 2;
    void *memory = malloc(size);
    std::lock_guard<std::mutex> lock(guard);
    allocated[memory] = size;
    *address = (uint64_t)memory;
    return memory ? 0 : 2;
}
EXPORT status cuMemFree_v2(uint64_t address)
{
    std::lock_guard<std::mutex> lock(guard);
    allocated.erase((void *)address);
    free((void *)address);
    return 0;
}
EXPORT status cuMemsetD8_v2(uint64_t at, unsigned char byte, size_t size)
{
    memset((void *)at, byte, size);
    return 0;
}
EXPORT status cuMemcpyHtoD_v2(uint64_t to, const void *from, size_t size)
{
    count("copies");
    memcpy((void *)to, from, size);
    return 0;
}
EXPORT status cuMemcpyDtoH_v2(void *to, uint64_t from, size_t size)
{
    count("copies");
    memcpy(to, (const void *)from, size);
    return 0;
}
